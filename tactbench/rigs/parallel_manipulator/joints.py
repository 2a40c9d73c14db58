"""The manipulator's three drives as one machine: whole moves, tested before they begin."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from tactbench.plugin import RigError, UsageError
from tactbench.plugin.devices import Driver
from tactbench.rigs.parallel_manipulator.geometry import Delta, LinearDelta
from tactbench.rigs.parallel_manipulator.kinematics import forward, inverse
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver
from tactbench.rigs.parallel_manipulator.motor.errors import MotorError
from tactbench.rigs.parallel_manipulator.press_moves import ManipulatorMoves, Move, Place, plan_presses
from tactbench.rigs.parallel_manipulator.settings import JOINTS, RigSettings
from tactbench.rigs.parallel_manipulator.trajectory import straight_move
from tactbench.rigs.parallel_manipulator.workspace import Workspace

WAIT_S = 0.005
"""Longest wait for one drive's next byte while three move."""
NEAR_M = 0.2e-3
"""How far the measured place may be from where it was sent (assumed: three joints, each within a drive's corridor)."""


def workspace_of(settings: RigSettings) -> Workspace | None:
    """Return where the manipulator may be; None: it is fixed. Raises UsageError for joints that are not linear."""
    if settings.manipulator == "fixed":
        return None
    if not isinstance(settings.manipulator, LinearDelta):
        raise UsageError(
            "This rig's joints are linear drives, and the manipulator is a rotary delta.",
            hint="Use a linear delta, or `manipulator: fixed`.",
        )
    return Workspace(settings.manipulator, settings.postures.limits())


def motor_travel_m(settings: RigSettings) -> tuple[float, float]:
    """Return retracted and farthest position of the linear motor [m]."""
    return 1e-3 * settings.limits.retreat_mm, 1e-3 * settings.limits.travel_mm[1]


def check_places(settings: RigSettings) -> None:
    """Raise PlaceRefusedError or MoveOrderError unless presses at all corners of what may be asked for are permitted.

    With straight rails the permitted places are convex, so the rectangle between the corners is as well.
    """
    workspace = workspace_of(settings)
    if workspace is None:
        return
    heights, corners = settings.heights.heights(), settings.places.corners_m()
    first = (*corners[0], heights.clearance_m)
    plan_presses(workspace, heights, motor_travel_m(settings), first, [*corners, corners[0], corners[2]])


class Joints:
    """Three linear drives that carry the platform.

    Parameters
    ----------
    drivers
        Open, in the order of the legs; closed by whoever opened them.
    settings
        Of the rig.
    """

    def __init__(self, drivers: Sequence[Driver], settings: RigSettings) -> None:
        workspace = workspace_of(settings)
        if workspace is None or not isinstance(workspace.delta, LinearDelta):
            raise UsageError("A fixed manipulator has no joints.", hint="Leave them out of the rig file.")
        self._drivers: dict[str, FaulhaberDriver] = {}
        for name, driver in zip(JOINTS, drivers, strict=True):
            if not isinstance(driver, FaulhaberDriver):
                raise UsageError("The manipulator's joints are not faulhaber devices.", hint="See docs/hardware.md.")
            self._drivers[name] = driver
        self._settings, self._workspace = settings, workspace
        self._delta: Delta = workspace.delta
        self.place_m: Place = (math.nan,) * 3

    def start(self) -> None:
        """Set the drives up, home them and give them power; raises as drivers do, and NoClosureError."""
        for name, driver in self._drivers.items():
            with _named(name):
                driver.identify()
                driver.start()
                driver.home()
                driver.enable()
        self.place_m = self.measured_m()

    def measured_m(self) -> Place:
        """Return where the platform is by the joints' own answers [m]."""
        q = np.array([self._locate(name) for name in JOINTS])
        x, y, z = forward(self._delta, q).tolist()
        return x, y, z

    def plan(self, xy_m: tuple[float, float]) -> tuple[Move, ...]:
        """Return the moves from here to the stand-off above a place, all tested; raises as `check_moves`."""
        heights = self._settings.heights.heights()
        (moves,) = plan_presses(self._workspace, heights, motor_travel_m(self._settings), self.place_m, [xy_m])
        return moves

    def go(self, moves: Sequence[Move], retracted: Callable[[], bool]) -> None:
        """Make moves, from where the platform is.

        Parameters
        ----------
        moves
            As planned from where the platform is.
        retracted
            Asked before each: whether the linear motor's answer says that it is out.

        Raises
        ------
        RigError
            If it is not, or the platform is not where it was sent.
        """
        motion = self._settings.motion
        for move in moves:
            if not retracted():
                raise RigError(
                    "The motor is not retracted, and the manipulator was to move.", hint="Home the motor anew."
                )
            if not isinstance(move, ManipulatorMoves) or move.start_m == move.end_m:
                continue
            start, end = np.array(move.start_m), np.array(move.end_m)
            # Tests the whole line, and that it can be kept within the joints' speeds; the way points are on it.
            straight_move(self._workspace, start, end, motion.limits(), rate_hz=10.0)
            pieces = max(1, math.ceil(float(np.linalg.norm(end - start)) / (1e-3 * motion.way_point_mm)))
            for n in range(1, pieces + 1):
                self._to(inverse(self._delta, start + n / pieces * (end - start)).tolist())
            self.place_m = move.end_m
        off = float(np.linalg.norm(np.subtract(self.measured_m(), self.place_m)))
        if off > NEAR_M:
            raise RigError(
                f"The platform is {1e3 * off:.3f} mm from where it was sent.",
                hint="Home the joints; check the geometry.",
            )

    def _to(self, q: Sequence[float]) -> None:
        for (name, driver), position_m in zip(self._drivers.items(), q, strict=True):
            with _named(name):
                driver.move_to(position_m)
        while any(driver.moving for driver in self._drivers.values()):
            for name, driver in self._drivers.items():
                with _named(name):
                    driver.update(WAIT_S)

    def _locate(self, name: str) -> float:
        with _named(name):
            return self._drivers[name].locate()


@contextmanager
def _named(joint: str) -> Iterator[None]:
    """Say which joint it is that an error is of: they have drives of one kind."""
    try:
        yield
    except MotorError as error:
        raise type(error)(f"{joint}: {error.message}", hint=error.hint) from error

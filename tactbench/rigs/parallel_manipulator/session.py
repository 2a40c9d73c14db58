"""The parts of the rig that are kept between scenes: the guard with all axes, homed once, and emulated devices."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.plugin import RigError
from tactbench.plugin.devices import (
    FORCE,
    Beat,
    CommandKind,
    DeviceSettings,
    EmulatedDevices,
    Guard,
    GuardProcess,
    GuardState,
    Limits,
    LocalGuard,
    PressingForce,
    ProcessSettings,
    RigFile,
    drivers_of,
)
from tactbench.rigs.parallel_manipulator.emulated_press import PressEmulators
from tactbench.rigs.parallel_manipulator.kinematics import LinearDelta, Place, forward, way, way_points
from tactbench.rigs.parallel_manipulator.settings import JOINTS, axes_of, with_limits

if TYPE_CHECKING:
    from tactbench.plugin import Block
    from tactbench.plugin.devices import Clock, Link

CHECK_S = 1.0
"""Time over which the force of a push by hand is averaged [s]."""
CHECK_FACTOR = 1.5
"""Largest ratio of a push and its reading: a hand is not more exact; a wrong unit gives a larger ratio (assumed)."""
NEAR_M = 0.2e-3
"""Largest distance of the measured place from its target [m] (assumed: three rails, each within a drive's corridor)."""


class Session:
    """Session that opens all devices but the sensor, and keeps them open until :meth:`close`.

    Real devices: force sensor and axes are held by a guard in a process of its own. Emulated ones are in virtual time,
    all in this process and thread. Axes are homed at the first scene, in the order of `axes_of`, and keep their home as
    long as drive and session live. Raises LinkError, RigError or UsageError if a link cannot be opened, or a device
    does not answer or differs from the rig file.

    Parameters
    ----------
    file
        The rig file; all its emulated sensors get emulators in this session.
    registry
        Registry of the installed devices.

    Attributes
    ----------
    checked
        Result of the check of the force sensor by a push; empty: not yet checked.
    """

    def __init__(self, file: RigFile, registry: Any) -> None:
        limited, self.settings = with_limits(file, registry)
        self._file = limited.checked_for_one_clock()
        self._registry, self._stack = registry, ExitStack()
        self.emulators: PressEmulators | None = None
        self.emulated: EmulatedDevices | None = None
        self.checked = ""
        self.clock: Clock = time.monotonic_ns
        self._links: Mapping[str, Callable[[], Link]] = {}
        with ExitStack() as opening:
            opening.callback(self._stack.close)
            if file.emulated:
                self.emulators = PressEmulators(file, registry)
                self.emulated = self._stack.enter_context(EmulatedDevices(self.emulators.devices))
                self.clock = self.emulated.clock
                self._links = {name: self.emulated.opener(name) for name in self.emulators.devices}
            self.guard = self._guard()
            self._stack.callback(self.guard.close)
            self.identity = self.guard.start()
            opening.pop_all()

    def close(self) -> None:
        """Disarm the guard and close all devices; axes hold their positions."""
        self._stack.close()

    def opened(self, sensor: str, *names: str) -> list[Any]:
        """Open and return drivers of devices by name, with `sensor` as the rig's sensor; the caller closes them."""
        drivers = drivers_of(self._file, self._registry, sensor, self._links, self.clock, names)
        return [drivers[name] for name in names]

    def _guard(self) -> Guard:
        names = axes_of(self.settings)
        if self.emulated is not None:
            *axes, force = self.opened(next(iter(self._file.sensors)), *names, FORCE)
            return LocalGuard(dict(zip(names, axes, strict=True)), force, self.clock, self.emulated.advance)

        def device(entry: Any) -> DeviceSettings:
            return DeviceSettings(self._registry.devices[entry.device].driver, entry.link, entry.options)

        of_axes = {name: device(self._file.devices[name]) for name in names}
        log = str(Path(self.settings.guard_log).expanduser().resolve())
        return GuardProcess(ProcessSettings(of_axes, device(self._file.force), log))

    # The beginning of a scene -----------------------------------------------------------------------------------------

    def measured_limits(self, *, confirmed: bool = False) -> tuple[PressingForce, Limits]:
        """Take the force sensor's zero while the guard is not armed; return the force sensor, and limits for the guard.

        `confirmed` is true if an operator has confirmed that the indenter is clear of the sensor.
        """
        assert self._file.force is not None
        settings, stream = self.settings, self.guard.force_stream
        force = PressingForce(self._file.force, (stream,))
        force.take_zero(self._fresh(self._file.force.zero_s))
        limits, touch = settings.limits, settings.touch
        kept = Limits(
            force_ceiling_n=limits.force_ceiling_n,
            travel_ceiling_n=limits.travel_ceiling_n,
            torque_ceiling_nm=limits.torque_ceiling_nm,
            touch_n=touch.single_n,
            clear_n=touch.mean_n,
            clear_s=1e-3 * touch.mean_ms,
            confirmed=confirmed,
            travel_m=(1e-3 * limits.travel_mm[0], 1e-3 * limits.travel_mm[1]),
            step_m=settings.force_loop.step_m,
            speed_m_s=1e-3 * max(touch.speed_mm_s, settings.press.unload_speed_mm_s),
            heartbeat_s=1e-3 * limits.heartbeat_ms,
            force_age_s=1e-3 * limits.force_age_ms,
            channel=force.column,
            sign=force.sign,
            zero=tuple(force.zero.tolist()),
        )
        return force, kept

    def _fresh(self, seconds: float) -> list[Block]:
        """Return the force samples received in the next `seconds`, without earlier samples."""
        since_ns = self.clock()
        self.guard.advance(since_ns + round(1e9 * seconds))
        found = [block.rows(block.t_ns >= since_ns) for block in self.guard.force_blocks if block.t_ns is not None]
        self.guard.force_blocks.clear()
        return found

    def travel(
        self, xy_m: tuple[float, float], ask: Callable[[str, str], bool] = lambda doing, text: False
    ) -> Place | None:
        """Home all axes that are not homed, and move the platform above a place; return the place measured there.

        The place is None without a platform. Before, an operator confirms that the indenter is clear of the sensor if
        this is not known, and the force sensor is checked once. The guard is armed meanwhile: it monitors the force,
        with the ceiling of travel, and can stop all rails. Raises
        RigError if the force of a push is read wrong, the path is not permitted, the guard stopped the move, or the
        platform is not at its target.

        Parameters
        ----------
        xy_m
            Target of the platform, x and y [m].
        ask
            Function that prompts an operator, see :func:`ask_operator`.
        """
        guard, delta, heights = self.guard, self.settings.manipulator, self.settings.heights
        if unclear := guard.disarm().unclear:  # of the scene before, if that ended in a fault
            ask(
                "check that the indenter is clear of the sensor",
                f"The indenter is not known to be clear of the sensor: {unclear}. Bring it to its place of retreat by "
                "hand or by the controller's own means, check that it touches nothing, and confirm.",
            )
        _, limits = self.measured_limits(confirmed=bool(unclear))
        self.checked = self.checked or self._check_force(limits, ask)
        report = guard.arm(limits)
        if not isinstance(delta, LinearDelta):
            guard.disarm()
            return None
        places = way(delta, _place_m(delta, report.positions), xy_m, heights.clearance_m, heights.stand_off_m)
        for point in way_points(delta, places):
            targets = dict(zip(JOINTS, point, strict=True))
            while targets or report.moving:
                now_ns, kind = self.clock(), CommandKind.TRAVEL if targets else CommandKind.NONE
                report = guard.beat(Beat(now_ns, "travel", kind, force_sequence=report.force_sequence, targets=targets))
                if report.state is not GuardState.ARMED or (report.reason and not report.early):
                    reason = report.trigger or report.reason
                    raise RigError(f"The manipulator was stopped on its way: {reason}.", hint="Check what blocks it.")
                targets = targets if report.early else {}
                guard.advance(now_ns + round(1e9 / self.settings.force_loop.rate_hz))
        place = _place_m(delta, guard.disarm().positions)
        off_m = math.dist(place, places[-1])
        if not off_m <= NEAR_M:
            raise RigError(
                f"The platform is {1e3 * off_m:.3f} mm away from its target.",
                hint=f"Home {', '.join(JOINTS)}; then check the geometry.",
            )
        return place

    def _check_force(self, limits: Limits, ask: Callable[[str, str], bool]) -> str:
        """Let an operator push the force sensor, and return the reading as text; raises RigError if it is wrong."""
        push_n = self.settings.press.check_n
        if push_n is None:
            return "NOT CHECKED: the rig file has `check_n: null`"
        what = f"Push the force sensor as a press would, with about {push_n:g} N ({1e3 * push_n / 9.80665:.0f} g)"
        asked = ask("push the force sensor", f"{what}; hold it for {1 + CHECK_S:g} s, and confirm now.")
        if not asked and self.emulators is None:
            return "NOT CHECKED: the devices are emulated"
        if self.emulators is not None:
            self.emulators.pushed_n = push_n
        pushed = [limits.pressing_n(block.data) for block in self._fresh(CHECK_S)]
        read_n = float(np.mean(np.concatenate(pushed))) if pushed else math.nan
        if self.emulators is not None:
            self.emulators.pushed_n = 0.0
        least_n, most_n = push_n / CHECK_FACTOR, push_n * CHECK_FACTOR
        if not least_n <= read_n <= most_n:
            raise RigError(
                f"The force sensor reads {read_n:+.3g} N in a push of about {push_n:g} N: {least_n:.2g} to {most_n:.2g}"
                " N are expected. Nothing has moved.",
                hint="Correct `sign:` under `force:` if negative; else unit, counts or calibration (kgf read 0.10, "
                "lbf 0.22 of the newtons).",
            )
        ask("take the hand off", "Take hand or weight off the force sensor again, and confirm.")
        return f"{read_n:.3g} N read in a push of about {push_n:g} N"


def _place_m(delta: LinearDelta, positions: Mapping[str, float]) -> Place:
    x, y, z = forward(delta, np.array([positions[name] for name in JOINTS])).tolist()
    return x, y, z

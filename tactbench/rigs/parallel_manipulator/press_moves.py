"""How a place is gone to: a list of moves in an order that keeps the indenter off the sensor, tested as a whole.

Retract the linear motor; up to the clearance plane; sideways there; down to the stand-off. In contact only the motor
moves: the manipulator's targets stay. `check_moves` refuses a list with a sideways move below the clearance plane, or
with the motor not retracted. Everything is tested before the first move: a plan is refused as a whole, and not at its
37th press.

Heights are those of the manipulator's point p at which the tip of the retracted indenter would have that height.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, FiniteFloat, model_validator

from tactbench.plugin import Quantity, RigError, assumed
from tactbench.rigs.parallel_manipulator.workspace import PlaceRefusedError, Workspace

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

Place = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
"""x, y, z of the manipulator's point [m]."""


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PressHeights(_Frozen):
    """Where the sensor's surface is expected, and how far from it to stay."""

    surface: Quantity
    """Height of the manipulator at which the retracted indenter would touch [length]."""
    surface_spread: Quantity = assumed(0.2, "mm", "standard deviation of the surface's height; measure it")
    cap_tolerance: Quantity = assumed(0.1, "mm", "of a cap's length from cap to cap; measure it")
    stand_off: Quantity = assumed(2.0, "mm", "a choice; at least 3 spreads and the tolerance of a cap")
    """Between tip and expected surface before the motor approaches [length]."""
    clearance: Quantity = assumed(10.0, "mm", "a choice; higher than everything beside the sensor")
    """Between tip and expected surface on sideways moves [length]."""
    depth: Quantity = assumed(4.0, "mm", "a choice; the skin's thickness decides")
    """How far below the expected surface the motor may go [length]."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        least = 3 * self.surface_spread.to("m") + self.cap_tolerance.to("m")
        if not 0 <= least <= self.stand_off.to("m"):
            raise ValueError(f"the stand-off is less than 3 spreads and the cap's tolerance, {1e3 * least:g} mm")
        if self.clearance.to("m") < self.stand_off.to("m"):
            raise ValueError("the clearance is less than the stand-off")
        if self.depth.to("m") <= 0:
            raise ValueError("the depth is not positive")
        return self

    @property
    def stand_off_m(self) -> float:
        """Height of the manipulator while the motor presses [m]."""
        return self.surface.to("m") + self.stand_off.to("m")

    @property
    def clearance_m(self) -> float:
        """Height of the manipulator on sideways moves [m]."""
        return self.surface.to("m") + self.clearance.to("m")

    @property
    def stroke_m(self) -> float:
        """The farthest the motor may leave its retracted position [m]."""
        return self.stand_off.to("m") + self.depth.to("m")


class MotorRetracts(_Frozen):
    """The linear motor goes to its retracted position, which its answer confirms."""

    kind: Literal["motor retracts"] = "motor retracts"


class ManipulatorMoves(_Frozen):
    """The manipulator goes straight from one place to another, the motor being retracted."""

    kind: Literal["manipulator moves"] = "manipulator moves"
    to: Literal["clearance", "above the place", "stand-off"]
    start_m: Place
    end_m: Place


Move = MotorRetracts | ManipulatorMoves


class MoveOrderError(RigError):
    """A list of moves would take the indenter sideways where the sensor may be, or jumps."""


def moves_to(here_m: Place, xy_m: tuple[float, float], heights: PressHeights) -> tuple[Move, ...]:
    """Return the moves from a place to the stand-off above `xy_m` [m]; untested."""
    x, y, z = here_m
    top = max(z, heights.clearance_m)
    raised, above, down = (x, y, top), (*xy_m, top), (*xy_m, heights.stand_off_m)
    return (
        MotorRetracts(),
        ManipulatorMoves(to="clearance", start_m=here_m, end_m=raised),
        ManipulatorMoves(to="above the place", start_m=raised, end_m=above),
        ManipulatorMoves(to="stand-off", start_m=above, end_m=down),
    )


def check_moves(
    workspace: Workspace, heights: PressHeights, motor_travel_m: tuple[float, float], moves: Sequence[Move]
) -> None:
    """Raise unless every move of a list may be made, one after the other; nothing has moved.

    Parameters
    ----------
    workspace
        Where the manipulator may be.
    heights
        Of the surface, the stand-off and the clearance.
    motor_travel_m
        Retracted and farthest permitted position of the motor [m], positive towards the sensor: the fourth joint.
    moves
        As of `moves_to`, of one press or of many.

    Raises
    ------
    PlaceRefusedError
        With number, place and value of the first move that leaves the workspace.
    MoveOrderError
        If the manipulator moves before the motor was retracted, sideways below the clearance plane, below the
        stand-off, or not from where it is; or if the motor's travel is shorter than its stroke.
    """
    retracted, farthest = motor_travel_m
    if not heights.stroke_m <= farthest - retracted:
        raise MoveOrderError(
            f"The motor's travel of {1e3 * (farthest - retracted):.2f} mm is shorter than stand-off and depth, "
            f"{1e3 * heights.stroke_m:.2f} mm together.",
            hint="Lower the stand-off or the depth.",
        )
    here: Place | None = None
    is_retracted = False
    for number, move in enumerate(moves, start=1):
        if isinstance(move, MotorRetracts):
            is_retracted = True
            continue
        reason = _out_of_order(move, here, heights, is_retracted)
        if reason:
            raise MoveOrderError(f"Move {number}, to {move.to}, is refused: {reason}.", hint="Nothing was moved.")
        try:
            workspace.check_move(np.array(move.start_m), np.array(move.end_m))
        except PlaceRefusedError as refused:
            refused.message = f"Move {number}, to {move.to}, is refused: {refused.message}"
            raise
        here = move.end_m


def _out_of_order(move: ManipulatorMoves, here: Place | None, heights: PressHeights, is_retracted: bool) -> str:
    """Return why a move of the manipulator may not be made now; empty: it may."""
    if not is_retracted:
        return "the motor was not retracted before it"
    if here is not None and move.start_m != here:
        return f"it starts at {move.start_m} m and the manipulator is at {here} m"
    lowest = min(move.start_m[2], move.end_m[2])
    if move.start_m[:2] != move.end_m[:2] and lowest < heights.clearance_m:
        return f"it goes sideways {1e3 * (heights.clearance_m - lowest):.2f} mm below the clearance plane"
    if move.end_m[2] < min(heights.stand_off_m, move.start_m[2]):
        return f"it ends {1e3 * (heights.stand_off_m - move.end_m[2]):.2f} mm below the stand-off"
    return ""


def plan_presses(
    workspace: Workspace,
    heights: PressHeights,
    motor_travel_m: tuple[float, float],
    here_m: Place,
    places_m: Iterable[tuple[float, float]] | FloatArray,
) -> tuple[tuple[Move, ...], ...]:
    """Return the moves to each of (n, 2) places [m], one press after the other, all tested; raises as `check_moves`."""
    plan: list[tuple[Move, ...]] = []
    for x, y in places_m:
        plan.append(moves_to(here_m, (float(x), float(y)), heights))
        here_m = (float(x), float(y), heights.stand_off_m)
    check_moves(workspace, heights, motor_travel_m, [move for moves in plan for move in moves])
    return tuple(plan)

"""Task: estimate the place of the contact on the skin from taxels.

In its recordings a ball is pressed at places spread over the skin; each recording has the place as a reference.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count

from tactbench.plugin import (
    ForceRamp,
    Indenter,
    Placement,
    PlannedScene,
    Quantity,
    Role,
    Scene,
    TaskDescriptor,
    TaskSpec,
    VectorTarget,
    assumed,
    hookimpl,
    sourced,
)

TACTBENCH_API = 2

REACH_MM = 5.0
"""Furthest commanded offset from the nominal contact point, along the finger and along its arc (assumed): a square of
10 mm, on which the caps of 5 mm touch both sensors' active skin throughout."""
SESSIONS: tuple[tuple[Role, int, int], ...] = (("train", 6, 10), ("validation", 2, 10), ("test", 5, 6))
"""Role, number of sessions, number of places in each session; an interval over sessions needs at least five."""
_SLOT_S = 30.0
"""Seconds from the beginning of one recording to the beginning of the next (assumed): a press and a move."""
_PRESS = ForceRamp(
    hold=assumed(2.0, "s", "unloaded, to tare on"),
    duration=assumed(12.0, "s", "2 s unloaded, then 0.5 N/s: slower than the skin creeps does not matter for a place"),
    samples=240,
)
_RADIUS = sourced(5.0, "mm", "Karl et al. 2016: the smallest of its caps")
_STEPS = (0.7548776662466927, 0.5698402909980532)
"""Steps 1/g and 1/g², with g³ = g + 1, whose multiples modulo 1 cover a square evenly (Roberts 2018, R2)."""


def _scenes() -> Iterator[PlannedScene]:
    """Yield the recordings; any run of consecutive places is spread evenly over the square."""
    order = count(1)
    for role, sessions, each in SESSIONS:
        for session in range(1, sessions + 1):
            for number in range(1, each + 1):
                place = next(order)
                x, s = (REACH_MM * (2 * ((0.5 + place * step) % 1.0) - 1) for step in _STEPS)
                scene = Scene(
                    name=f"place-{role}-{session}-{number}",
                    indenter=Indenter(radius=_RADIUS),
                    placement=Placement(x=_commanded(x), s=_commanded(s)),
                    profile=_PRESS,
                    session=f"{role}-{session}",
                    starts_after_s=_SLOT_S * (number - 1),
                    observe=("taxel", "position"),
                )
                yield PlannedScene(role=role, scene=scene)


def _commanded(offset_mm: float) -> Quantity:
    return assumed(round(offset_mm, 3), "mm", "one of the places scattered over the skin")


LOCATION_SCENES = tuple(_scenes())

SPEC = TaskSpec(
    name="contact-location",
    title="Contact location",
    question="Where on the skin does it touch?",
    kind="regression",
    # In the recording's own frame; the twin's is the unrolled skin: x along the finger, y along the arc.
    target=VectorTarget(kind="position", names=("x", "y"), unit="mm"),
    metric="mean_euclidean_error",
    unit="mm",
    equivalence=0.1,  # assumed: as far apart as two presses at one commanded place, see Placement.scatter
    scenes=LOCATION_SCENES,
    protocols=("deployable", "deployable-untared"),
    splits=("roles", "session", "recording", "shuffled"),
    estimators=("forest-100", "ridge"),
    baselines=("mean", "time-index"),
)


@hookimpl
def tactbench_tasks() -> list[TaskDescriptor]:
    """Return the descriptor of the contact location task."""
    return [TaskDescriptor(spec=SPEC)]

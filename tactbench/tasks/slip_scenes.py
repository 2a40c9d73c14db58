"""Recordings for the slip tasks: surfaces dragged over a pressed skin, and disturbances without slip.

A cap is pressed and held; at a varying moment its surface begins to move, and moves to the end. In a disturbance the
surface moves by so little that the skin follows without slip (the start of a motor), and the normal force changes:
presses, taps, ripples. Every condition is recorded in each of four sessions, two of them for training.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from tactbench.plugin import ForcePath, Indenter, Placement, PlannedScene, Role, Scene, Source, assumed, derived
from tactbench.plugin.simulation import Environment, Slide, Surface

_CHOICE = "a condition of the slip campaign"
SESSIONS: Mapping[str, Role] = {
    "train-1": "train", "train-2": "train", "validation": "validation", "test": "test",
}  # fmt: skip
"""Names of the recording sessions, and their role: training, validation or test."""
SPEEDS_MM_S = (10.0, 20.0, 50.0)
FORCES_N = (0.5, 1.5)
REFERENCE_HZ = 500.0
"""Rate of the reference clock: the onset of slip is labelled to 2 ms."""
HOLD_S, PRESS_S = 0.5, 0.3
"""Durations [s] without contact at the beginning of a recording, and of the force's rise."""
EARLIEST_S, SPREAD_S = 1.6, 1.0
"""Earliest start [s] of a drag, and its largest additional delay [s]; it varies so that time does not predict slip."""
SLIP_S = 4.6
"""Duration [s] of a recording with a slip."""
PATTERN_S = 12.0
"""Duration [s] of a pattern of disturbances; the first pattern begins at 3 s."""
TIMES: Mapping[Role, int] = {"train": 1, "validation": 3, "test": 3}
"""Number of recordings of each disturbance, and of patterns in each recording, by role: six disturbances, nine times,
last eleven minutes, in which one false alarm per minute is more than ten alarms."""
DISTURBED_S = 3.0
"""Duration [s] of a recording of disturbances without its patterns."""
START_MM = 0.02
"""Distance [mm] that the surface moves when a motor starts without slip: a fifth of the least distance by which a
BioTac's skin follows a surface (0.11 mm), and of the displacement that is labelled a slip."""
SLOT_S = 60.0
_GOLDEN = 0.6180339887498949
"""Fractional part of the golden ratio, whose multiples modulo 1 spread evenly over 0 to 1."""


def _surface(static: float, kinetic: float, rms_um: float, roll_off_mm: float) -> Surface:
    return Surface(
        static_friction=assumed(static, "1", _CHOICE),
        kinetic_friction=assumed(kinetic, "1", _CHOICE),
        roughness=assumed(rms_um, "um", _CHOICE),
        roll_off=assumed(roll_off_mm, "mm", _CHOICE),
    )


SURFACES: Mapping[str, Surface] = {
    "smooth": _surface(0.5, 0.45, 2.0, 0.1),
    "default": Surface(),
    "coarse": _surface(0.6, 0.5, 150.0, 1.0),
    "knit": _surface(0.9, 0.78, 100.0, 2.0),
}
"""Dragged surfaces: a polished one, the twin's default, a coarse one, and a knitted fabric."""

Points = list[tuple[float, float]]
"""Corners of a force profile: pairs of a time [s] and a force [N]."""


def presses(force_n: float, patterns: int) -> Points:
    """Return a force profile with four releases and presses in each pattern, each slower than the one before."""
    points = []
    for place in range(4 * patterns):
        number, begin_s = place % 4, 3.0 + 3.0 * place
        ramp_s = 0.05 * 2.0**number
        points += [(begin_s, force_n), (begin_s + ramp_s, 0.0), (begin_s + 1.0, 0.0), (begin_s + 1.0 + ramp_s, force_n)]
    return points


def taps(force_n: float, patterns: int) -> Points:
    """Return a force profile of `patterns` times eight taps at uneven intervals; a tap adds 0.5 N for 30 ms."""
    points = []
    for number in range(8 * patterns):
        begin_s = 3.0 + PATTERN_S * (number // 8) + 1.3 * (number % 8) + 0.5 * (_GOLDEN * number % 1.0)
        points += [(begin_s, force_n), (begin_s + 0.01, force_n + 0.5), (begin_s + 0.03, force_n)]
    return points


def ripples(force_n: float, patterns: int) -> Points:
    """Return a force profile with three triangular 2 s ripples per pattern: 5 Hz (a fifth of the force), 20, 40 Hz."""
    points = []
    for place in range(3 * patterns):
        begin_s, (rate_hz, share) = 3.0 + 4.0 * place, ((5.0, 0.2), (20.0, 0.05), (40.0, 0.02))[place % 3]
        quarter_s = 0.25 / rate_hz
        turns = [
            (begin_s + (2 * turn + 1) * quarter_s, force_n * (1.0 + share * (-1.0) ** turn))
            for turn in range(round(4.0 * rate_hz))
        ]
        points += [(begin_s, force_n), *turns, (begin_s + 2.0, force_n)]
    return points


DISTURBANCES: Mapping[str, Callable[[float, int], Points]] = {"presses": presses, "taps": taps, "ripples": ripples}
"""Functions that return the normal force of disturbances without slip, by kind of disturbance."""


def _profile(force_n: float, length_s: float, points: Points) -> ForcePath:
    path = [(0.0, 0.0), (HOLD_S, 0.0), (HOLD_S + PRESS_S, force_n), *points, (length_s, force_n)]
    return ForcePath(
        times_s=tuple(time for time, _ in path),
        forces_n=tuple(force for _, force in path),
        samples=round(REFERENCE_HZ * length_s),
        source=Source(tag="assumed", reference=_CHOICE),
    )


def _planned(
    name: str, session: str, number: int, surface: str, speed_mm_s: float, force_n: float, kind: str = "", time: int = 0
) -> PlannedScene:
    """Return the plan of one recording, of a slip or of a kind of disturbance."""
    start_s = EARLIEST_S + SPREAD_S * (_GOLDEN * number % 1.0)
    patterns = TIMES[SESSIONS[session]]
    own = DISTURBANCES[kind](force_n, patterns) if kind else []
    slide = Slide(
        speed=assumed(speed_mm_s, "mm/s", _CHOICE),
        start=assumed(round(start_s, 4), "s", "drawn so that no clock tells it"),
        duration=assumed(START_MM / speed_mm_s, "s", "the start of a motor, which the skin follows") if kind else None,
        surface=SURFACES[surface],
    )
    scene = Scene(
        name=f"{name}-{session}" + (f"-{time}" if time else ""),
        indenter=Indenter(radius=assumed(20.0, "mm", _CHOICE)),
        placement=Placement(scatter=assumed(0.5, "mm", "so that no two recordings press one place")),
        profile=_profile(force_n, DISTURBED_S + PATTERN_S * patterns if kind else SLIP_S, own),
        slide=slide,
        environment=Environment(
            force_noise=derived(
                8.0,
                "mN",
                "12 bits on +-10 V of a Nano17 give 8 to 20 mN; the unfiltered 0.7 N of the paper's set-up "
                "would hide the ratio of the forces",
            )
        ),
        session=session,
        starts_after_s=SLOT_S * number,
        observe=("taxel", "dc_pressure", "ac_pressure"),
        labels={
            "event": "disturbance" if kind else "slip",
            "friction_coefficient": SURFACES[surface].static_friction.to("1"),
            "condition": name,
            "surface": surface,
        },
    )
    return PlannedScene(scene=scene, role=SESSIONS[session], drawn_order=f"slip-{session}")


def _campaign() -> Iterator[PlannedScene]:
    per_session = len(SURFACES) * len(SPEEDS_MM_S) * len(FORCES_N) + len(DISTURBANCES) * len(FORCES_N)
    for place, session in enumerate(SESSIONS):
        number = 0
        # The moments of a session are another stretch of the same sequence: no condition keeps its own.
        for surface in SURFACES:
            for speed in SPEEDS_MM_S:
                for force in FORCES_N:
                    name = f"{surface}-{speed:g}mm-s-{force:g}N"
                    yield _planned(name, session, place * per_session + number, surface, speed, force)
                    number += 1
        for time in range(TIMES[SESSIONS[session]]):
            for kind in DISTURBANCES:
                for force in FORCES_N:
                    surface = list(SURFACES)[(number + place) % len(SURFACES)]
                    name = f"{kind}-{force:g}N"
                    yield _planned(name, session, place * per_session + number, surface, 20.0, force, kind, time)
                    number += 1


SLIP_SCENES: tuple[PlannedScene, ...] = tuple(_campaign())
"""Recordings of four sessions: 24 conditions of slip once each; six of disturbances, three times outside training."""

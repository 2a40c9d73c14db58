"""The recordings of the tasks: surfaces, places, units and sessions.

One campaign serves several tasks: each takes the surfaces that it needs, and a scene in two of them is recorded
once. The paper's own three sessions are as Karl et al. 2016 describe them. The campaigns beyond the paper take 1000
samples in the paper's 60 s: neighbouring rows of a slow ramp hold little new. All begin an hour after power-on, a
scene's default, so that a cap, a placement, a unit or a session differs by itself and not by the sensor's warm-up.
"""

from __future__ import annotations

from collections.abc import Mapping

from tactbench.plugin import ForceRamp, Indenter, Placement, PlannedScene, Quantity, Role, Scene, assumed, sourced

PAPER = "Karl et al. 2016"
RADII_MM = (5.0, 7.5, 10.0, 20.0, 40.0)
"""Radii of the caps; source: the paper's figure of curved objects."""
FLAT = "flat"
"""Label of the surface without a radius; it stands for an infinite one."""
Surfaces = tuple[float | None, ...]
SURFACES: Surfaces = (*RADII_MM, None)
"""Radii in mm; None is flat."""
SLOT_S = 120.0
"""A minute of recording and a minute to exchange the cap."""

PLACES_MM = ((0.0, 0.0), (1.5, 0.0), (-1.5, 0.0), (0.0, 1.5), (0.0, -1.5))
"""Commanded offsets (along the finger, along its arc) from the nominal contact point: half a pad's 3 mm, a cross."""
UNITS = ("1", "2", "3", "4", "5")
TRAINING_SESSIONS = 10
TEST_SESSIONS = 5
"""Fewest sessions from which an interval over sessions can be computed."""
FEW = (1, 2, 5, 10)
"""Training sessions of the few-shot splits."""

SHORT = ForceRamp(samples=1000)
NOMINAL = Placement()
NOTHING: Mapping[str, str] = {}


def indenter(radius_mm: float | None) -> Indenter:
    """Return a cap, or flat."""
    if radius_mm is None:
        return Indenter()
    return Indenter(radius=sourced(radius_mm, "mm", f"{PAPER}, figure of curved objects"))


def labels(radius_mm: float | None) -> dict[str, str | float | int]:
    """Return the labels of a surface for all tasks: its radius, and its curvature in 1/m."""
    if radius_mm is None:
        return {"cap_radius_mm": FLAT, "inverse_radius_per_m": 0.0}
    return {"cap_radius_mm": radius_mm, "inverse_radius_per_m": 1e3 / radius_mm}


def surface_name(radius_mm: float | None) -> str:
    """Return a surface's name, fit for a file name."""
    return FLAT if radius_mm is None else f"cap-{radius_mm:g}mm"


def papers_caps() -> tuple[PlannedScene, ...]:
    """Return the paper's curvature recordings: every cap once in each of three sessions, one after the other.

    The paper does not state in which order the caps followed each other: it is drawn, session by session, so that the
    warm-up of the sensor does not reveal the cap.
    """
    return tuple(
        PlannedScene(
            role=role,
            drawn_order=f"caps-{role}",
            scene=Scene(
                name=f"{surface_name(radius)}-{role}",
                indenter=indenter(radius),
                session=role,
                starts_after_s=SLOT_S * (len(RADII_MM) * session + place),
                labels=labels(radius),
            ),
        )
        for session, role in enumerate(("train", "validation", "test"))
        for place, radius in enumerate(RADII_MM)
    )


def at_places(surfaces: Surfaces = SURFACES) -> tuple[PlannedScene, ...]:
    """Return recordings at every place, all surfaces at one place before the next."""
    return tuple(
        _planned(
            radius,
            f"place-{number + 1}",
            first_slot=len(SURFACES) * number,
            placement=Placement(x=_commanded(x), s=_commanded(s)),
            more={"placement": f"x {x:+g} s {s:+g} mm"},
        )
        for number, (x, s) in enumerate(PLACES_MM)
        for radius in surfaces
    )


def on_units(surfaces: Surfaces = SURFACES) -> tuple[PlannedScene, ...]:
    """Return recordings on every unit of the sensor, each as warm as the others."""
    return tuple(
        _planned(radius, f"unit-{unit}", unit=unit, more={"unit": unit}) for unit in UNITS for radius in surfaces
    )


def in_sessions(number: int, surfaces: Surfaces = SURFACES) -> tuple[PlannedScene, ...]:
    """Return the first `number` training sessions, one recording of every surface each."""
    return tuple(
        _planned(radius, f"session-{session}", first_slot=len(SURFACES) * (session - 1))
        for session in range(1, number + 1)
        for radius in surfaces
    )


def few_shots(surfaces: Surfaces = SURFACES) -> dict[str, tuple[PlannedScene, ...]]:
    """Return the campaign of every few-shot split: its training sessions, and test sessions that all of them share."""
    test = tuple(
        _planned(radius, f"test-{session + 1}", role="test", first_slot=len(SURFACES) * (TRAINING_SESSIONS + session))
        for session in range(TEST_SESSIONS)
        for radius in surfaces
    )
    return {f"few-shot-{number}": (*in_sessions(number, surfaces), *test) for number in FEW}


def _planned(
    radius_mm: float | None,
    session: str,
    *,
    role: Role = "train",
    first_slot: int = 0,
    unit: str = "1",
    placement: Placement = NOMINAL,
    more: Mapping[str, str] = NOTHING,
) -> PlannedScene:
    """Return one recording; its slot is that of its surface in the whole campaign, whichever others are recorded."""
    scene = Scene(
        name=f"{surface_name(radius_mm)}-{session}",
        indenter=indenter(radius_mm),
        placement=placement,
        profile=SHORT,
        session=session,
        unit=unit,
        starts_after_s=SLOT_S * (first_slot + SURFACES.index(radius_mm)),
        labels={**labels(radius_mm), **more},
    )
    return PlannedScene(scene=scene, role=role)


def _commanded(offset_mm: float) -> Quantity:
    return assumed(offset_mm, "mm", "a place of the campaign, half way to the edge of what both sensors take")

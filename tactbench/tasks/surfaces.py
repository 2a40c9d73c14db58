"""Recordings of the force and curvature tasks: surfaces, places, sensor units and sessions.

Several tasks share one set of recordings: each uses the surfaces that it needs, and a scene in two tasks is recorded
once. The three sessions of the paper are as Karl et al. 2016 describe them. Other recordings take 1000 samples in the
paper's 60 s, because neighbouring samples of a slow ramp are nearly equal. All begin an hour after power-on, a scene's
default, so that differences between caps, placements, units or sessions do not come from the sensor's warm-up.
"""

from __future__ import annotations

from collections.abc import Mapping

from tactbench.plugin import ForceRamp, Indenter, Placement, PlannedScene, Quantity, Role, Scene, assumed, sourced

PAPER = "Karl et al. 2016"
RADII_MM = (5.0, 7.5, 10.0, 20.0, 40.0)
"""Radii of the spherical caps; source: the figure of curved objects in Karl et al. 2016."""
FLAT = "flat"
"""Label of the flat surface, in place of an infinite radius."""
Surfaces = tuple[float | None, ...]
SURFACES: Surfaces = (*RADII_MM, None)
"""All surfaces by their radius [mm]; None is the flat surface."""
SLOT_S = 120.0
"""Seconds between the beginnings of two recordings: a minute of recording and a minute to exchange the cap."""

PLACES_MM = ((0.0, 0.0), (1.5, 0.0), (-1.5, 0.0), (0.0, 1.5), (0.0, -1.5))
"""Commanded offsets (along the finger, along its arc) from the nominal contact point: a cross of half a pad's 3 mm."""
UNITS = ("1", "2", "3", "4", "5")
TRAINING_SESSIONS = 10
TEST_SESSIONS = 5
"""Number of test sessions: the least from which a confidence interval over sessions can be computed."""
FEW = (1, 2, 5, 10)
"""Numbers of training sessions in the few-shot splits."""

SHORT = ForceRamp(samples=1000)
NOMINAL = Placement()
NOTHING: Mapping[str, str] = {}


def indenter(radius_mm: float | None) -> Indenter:
    """Return a spherical cap of the radius `radius_mm`, or the flat surface for None."""
    if radius_mm is None:
        return Indenter()
    return Indenter(radius=sourced(radius_mm, "mm", f"{PAPER}, figure of curved objects"))


def labels(radius_mm: float | None) -> dict[str, str | float | int]:
    """Return the labels of a surface for all tasks: its radius, and its curvature in 1/m."""
    if radius_mm is None:
        return {"cap_radius_mm": FLAT, "inverse_radius_per_m": 0.0}
    return {"cap_radius_mm": radius_mm, "inverse_radius_per_m": 1e3 / radius_mm}


def surface_name(radius_mm: float | None) -> str:
    """Return the name of a surface, with characters allowed in a file name."""
    return FLAT if radius_mm is None else f"cap-{radius_mm:g}mm"


def papers_caps() -> tuple[PlannedScene, ...]:
    """Return the curvature recordings of Karl et al. 2016: every cap once in each of three consecutive sessions.

    The paper does not state the order of the caps: it is drawn for each session, so that the warm-up of the sensor
    does not reveal the cap.
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
    """Return recordings of `surfaces` at every place; all surfaces at one place precede those at the next."""
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
    """Return recordings of `surfaces` on every unit of the sensor, all units being equally warm."""
    return tuple(
        _planned(radius, f"unit-{unit}", unit=unit, more={"unit": unit}) for unit in UNITS for radius in surfaces
    )


def in_sessions(number: int, surfaces: Surfaces = SURFACES) -> tuple[PlannedScene, ...]:
    """Return the recordings of the first `number` training sessions, one of every surface in each session."""
    return tuple(
        _planned(radius, f"session-{session}", first_slot=len(SURFACES) * (session - 1))
        for session in range(1, number + 1)
        for radius in surfaces
    )


def few_shots(surfaces: Surfaces = SURFACES) -> dict[str, tuple[PlannedScene, ...]]:
    """Return the recordings of every few-shot split, by name: its training sessions, and the common test sessions."""
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
    """Return one recording; its start time depends on its surface, not on the selection of other recordings."""
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

"""Check of a rig file: largest forces that it permits, and reasons to refuse it; no device is opened or moved."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tactbench.plugin import RigError, TactbenchError, UsageError, load_registry
from tactbench.plugin.devices import CheckTable, LoopModel, PositionerFacts, RigCheck, RigFile, largest_force_n
from tactbench.rigs.parallel_manipulator.kinematics import LinearDelta, check_move, links, solve_inverse, way
from tactbench.rigs.parallel_manipulator.settings import JOINTS, MOTOR, RigSettings, axes_of, axis_of, with_limits

LOOK_S = 7e-3
"""Time of one check by the guard, with scheduling delay [s]: part of a reaction, besides the age of the force and the
axis' latency."""
MOST_OF_LIMIT = 0.5
"""Largest permitted part of the largest stable gain: the rest is for overshoot and skins stiffer than declared."""
_MANDATORY = ("lower_m", "upper_m", "speed_m_s", "acceleration_m_s2", "corridor_m", "orientation")
_UNITS = ("increment_m", "speed_unit_m_s", "acceleration_unit_m_s2", "current_unit_a")


def check(file: RigFile) -> RigCheck:
    """Return tables of the largest forces of axes and force loop, and the problems for which the file is refused.

    Raises UsageError if the file lacks a value, has one that a drive does not support, or names an unknown device.
    """
    registry = load_registry()
    file, settings = with_limits(file, registry)
    problems: list[str] = []
    facts: dict[str, PositionerFacts] = {}
    most_n: dict[str, float] = {}
    axes: list[tuple[str, ...]] = []
    for name in axes_of(settings):
        kind, options = axis_of(registry, name, file.devices[name])
        most_n[name] = math.inf if options.largest_force_n is None else options.largest_force_n
        of_axis = _axis_problems(settings, name, options)
        try:
            facts[name] = kind.facts_of(options)
            for speed_mm_s in (settings.touch.touch_speed_mm_s, settings.press.unload_speed_mm_s):
                kind.facts_of(options.model_copy(update={"speed_m_s": 1e-3 * speed_mm_s} if name == MOTOR else {}))
        except RigError as error:
            raise UsageError(" ".join([f"{name}: {error.message}", *of_axis]), hint=error.hint) from error
        problems += of_axis
        axes.append((name, *_axis_row(options)))
    forces, found = _forces(settings, facts, most_n[MOTOR])
    problems += found
    delta = settings.manipulator
    if isinstance(delta, LinearDelta):
        try:
            _check_places(delta, settings)
        except TactbenchError as error:
            problems.append(str(error))
        together_n = _together_n(delta, settings, [most_n[name] for name in JOINTS])
        if math.isfinite(together_n):
            sources = ", ".join(dict.fromkeys(source for name, _, _, source, _ in axes if name in JOINTS))
            axes.append((", ".join(JOINTS), "act together", f"{together_n:.1f} N", sources, ""))
            problems += _too_strong(f"{', '.join(JOINTS)} together", together_n, settings)
    tables = (
        CheckTable("axes", ("axis", "stands", "largest force", "by", "units that are ASSUMED"), tuple(axes)),
        CheckTable("largest forces, and the force loop", ("what", "value"), tuple(forces)),
    )
    return RigCheck(tables, tuple(problems), file, settings.limits.travel_ceiling_n)


def _check_places(delta: LinearDelta, settings: RigSettings) -> None:
    """Raise PlaceRefusedError unless presses at all corners of the reach are permitted.

    With straight rails the permitted places are convex, so the rectangle between the corners is permitted as well.
    """
    heights, corners = settings.heights, settings.places.corners_m()
    here = (*corners[0], heights.clearance_m)
    check_move(delta, np.array(here), np.array(here))
    for corner in (*corners, corners[0], corners[2]):
        here = way(delta, here, corner, heights.clearance_m, heights.stand_off_m)[-1]


def _together_n(delta: LinearDelta, settings: RigSettings, most_n: Sequence[float]) -> float:
    """Return the largest norm of the rails' joint force on the platform within the reach [N]; NaN: not known.

    F = U^T S^-1 f for forces f along the rails (derived: their power is the platform's, U p' = S q'). F is linear
    in f, so the largest norm is at extreme values of all f.
    """
    heights = (settings.heights.stand_off_m, settings.heights.clearance_m)
    places_m = np.array([(*corner, height) for corner in settings.places.corners_m() for height in heights])
    q, missing = solve_inverse(delta, places_m)
    if (missing > 0).any() or not np.isfinite(most_n).all():
        return math.nan
    unit = links(delta, places_m, q)
    per_newton = unit / np.einsum("pij,ij->pi", unit, delta.rail)[..., None]
    ends = np.array(list(itertools.product((-1.0, 1.0), repeat=len(most_n)))) * most_n
    return float(np.linalg.norm(np.einsum("si,pij->spj", ends, per_newton), axis=-1).max())


def _too_strong(what: str, force_n: float, settings: RigSettings) -> list[str]:
    rated_n = settings.limits.rated_force_n
    if force_n <= rated_n:
        return []
    return [
        f"{what} can exert {force_n:.1f} N, and the weakest part bears {rated_n:g} N: if the force sensor reads "
        "wrong values, only the drive limits the force. Lower the peak current."
    ]


def _axis_problems(settings: RigSettings, name: str, options: Any) -> list[str]:
    force_n: float | None = options.largest_force_n
    mandatory = [*_MANDATORY, *(("brake", "counterweight") if options.orientation == "vertical" else ())]
    missing = [option for option in mandatory if getattr(options, option) is None]
    if force_n is None:
        missing.append("peak_force_n (or peak current and force constant)")
    problems = [] if force_n is None else _too_strong(f"The {name}'s drive", force_n, settings)
    if missing:
        problems.append(f"The options of {name} lack {', '.join(missing)}; state them in the rig file.")
    skin, away = (1, "negative") if name == MOTOR else (-1, "positive")
    if options.homes_towards() == skin:
        problems.append(f"The {name} is homed towards the skin. Make homing_speed_m_s {away}.")
    return problems


def _axis_row(options: Any) -> tuple[str, ...]:
    """Return an axis' orientation, its largest force with the source, and the units missing in the rig file."""
    force_n = options.largest_force_n
    without = "holds without power" if options.holds_unpowered else "FALLS without power: it stays powered"
    assumed = [name for name in _UNITS if name in type(options).model_fields and name not in options.model_fields_set]
    return (
        f"{options.orientation or 'not stated'}, {without}",
        "not stated" if force_n is None else f"{force_n:.1f} N",
        options.force_source,
        ", ".join(f"{name} {getattr(options, name):g}" for name in assumed),
    )


def _forces(
    settings: RigSettings, facts: Mapping[str, PositionerFacts], drive_n: float
) -> tuple[list[tuple[str, str]], list[str]]:
    """Return the largest force in each situation, and a problem for each force above its limit.

    A reaction is assumed as late as the rig file permits: at the largest age of the force that the guard accepts.
    """
    limits, touch, stiffness, motor = settings.limits, settings.touch, settings.stiffness, facts[MOTOR]
    loop = settings.force_loop
    age_s = 1e-3 * limits.force_age_ms
    react_s = age_s + LOOK_S + motor.stop_latency_s
    slow, acceleration = 1e-3 * touch.touch_speed_mm_s, 1e-3 * touch.acceleration_mm_s2
    k, soft = 1e3 * stiffness.at_ceiling_n_mm, 1e3 * stiffness.at_touch_n_mm
    by_step = limits.force_ceiling_n + k * (loop.step_m + motor.corridor)
    by_approach = largest_force_n(limits.force_ceiling_n, k, slow, acceleration, react_s)
    # A control period, and the mean of a rising force is half its time behind; or three single samples.
    behind_s = 1 / loop.rate_hz + 0.5e-3 * touch.mean_ms
    first = min(
        largest_force_n(touch.mean_n, soft, slow, acceleration, react_s + behind_s),
        largest_force_n(touch.single_n, soft, slow, acceleration, react_s + 3e-3),
    )
    rails = [
        largest_force_n(limits.travel_ceiling_n, k, one.speed, one.acceleration, age_s + LOOK_S + one.stop_latency_s)
        for name, one in facts.items()
        if name != MOTOR
    ]
    # The way until a force that reads wrong is noticed: of the approach, and on the ramp (see `devices.press`).
    way_m = max(
        settings.found_m - settings.surface_m + 1e-3 * settings.heights.tolerance_mm,
        2 * settings.touch_way_m + 1e-6 * touch.mean_ms * loop.speed_mm_s,
    )
    delay_s = 1e-3 * loop.delay_ms
    model = LoopModel.around(loop.law(limits.travel_mm), lag_s=1e-3 * loop.motor_lag_ms, delay_s=delay_s)
    used = 1e3 * stiffness.greatest_n_mm / model.largest_stiffness()
    rows = [
        (
            "reaction",
            f"{1e3 * react_s:.1f} ms, of which {1e3 * age_s:.1f} ms age of the force and "
            f"{1e3 * motor.stop_latency_s:.1f} ms of motor and line",
        ),
        ("under force control", f"{by_step:.2f} N: ceiling, one increment and the corridor"),
        ("in an approach with an undetected touch", f"{by_approach:.2f} N: ceiling and reaction"),
        (
            "if the force sensor stops responding",
            f"{min(by_approach + k * way_m, drive_n):.2f} N, at most the drive's; detected after {1e3 * way_m:.2f} mm",
        ),
        ("first touch", f"{first:.2f} N, {touch.allowed_n:g} N are allowed"),
        *([("of a rail that moves down onto an object", f"{max(rails):.2f} N")] if rails else ()),
        ("share of the largest stable gains", f"{used:.2f}, at most {MOST_OF_LIMIT:g}"),
    ]
    largest = max(by_step, by_approach, *rails)
    sound = {
        f"The force may come to {largest:.2f} N; the weakest part is rated for {limits.rated_force_n:.2f} N. Lower the "
        "speed, the ceiling, force_age_ms or the approach's threshold, or speed the line up.": (
            largest <= limits.rated_force_n
        ),
        f"The first touch may come to {first:.2f} N; {touch.allowed_n:g} N are allowed. Lower touch_speed_mm_s, mean_n "
        "or mean_ms.": first <= touch.allowed_n,
        f"The motor follows a command after up to {1e3 * motor.stop_latency_s:.1f} ms; control period and delay_ms are "
        f"{1e3 / loop.rate_hz + loop.delay_ms:g} ms together. Lower rate_hz, raise delay_ms, or speed the line up.": (
            motor.stop_latency_s <= 1 / loop.rate_hz + delay_s
        ),
        f"The force loop's gains are {used:.2f} of the largest stable gains at the greatest stiffness; at most "
        f"{MOST_OF_LIMIT:g} is permitted. Divide both gains by {used / MOST_OF_LIMIT:.2f} or more.": (
            used <= MOST_OF_LIMIT
        ),
    }
    return rows, [problem for problem, holds in sound.items() if not holds]  # not a number: it does not hold

"""What a rig file would let this rig do, and why it would be refused; nothing is opened and nothing moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from tactbench.plugin import RigError, TactbenchError, UsageError, load_registry
from tactbench.plugin.devices import (
    CheckTable,
    PositionerFacts,
    RigCheck,
    RigFile,
    largest_force_n,
    read_options,
)
from tactbench.rigs.parallel_manipulator.motor.codec import line_time_s
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.platform import Platform
from tactbench.rigs.parallel_manipulator.settings import (
    JOINTS,
    MOTOR,
    RigSettings,
    axes_of,
    positioner_of,
    settings_of,
    with_limits,
)

WATCH_S = 8e-3
"""Age of the force at 1 kHz, a look of the guard, and scheduling: what a reaction has beside the axis' own latency."""
INCREMENT_BYTES = 65
"""Of one increment and the look that confirms its end, and their answers: LA-12345, OK, M, OK, TPOS, -12345, POS,
-12345, GRC, 1234, OST, 65536, each with CR, answers with LF as well."""
_MANDATORY = ("lower_m", "upper_m", "speed_m_s", "acceleration_m_s2", "corridor_m", "orientation")
_UNITS = ("increment_m", "speed_unit_m_s", "acceleration_unit_m_s2", "current_unit_a")


def refuse(file: RigFile) -> None:
    """Raise UsageError if a rig file is refused for what it says; raises as :func:`check` as well."""
    problems = check(file).problems
    if problems:
        raise UsageError(
            f"The rig file is refused: {problems[0]}",
            hint="`tactbench doctor --rig-file FILE --seconds 0` says all that it would do.",
        )


def check(file: RigFile) -> RigCheck:
    """Return what axes, loop, forces and places come to, and what is refused.

    Raises
    ------
    UsageError, UnknownNameError
        If the file lacks something, or names what is not installed.
    """
    settings, registry = settings_of(file), load_registry()
    file = with_limits(file, settings, registry)
    tables, problems, facts = [], [], {}

    def refusing(do: Callable[[], object]) -> None:
        """Keep what `do` raises as a problem."""
        try:
            do()
        except TactbenchError as error:
            problems.append(str(error))

    for name in axes_of(settings):
        kind, given = positioner_of(registry, name, file.devices[name])
        options = read_options(kind.options_kind, given, name)
        try:
            facts[name] = kind.facts_of(options)
        except RigError as error:
            raise UsageError(f"{name}: {error.message}", hint=error.hint) from error
        problems += _axis_problems(settings, name, options)
        tables.append(CheckTable(name, ("what", "value"), _axis_rows(options)))
        if name == MOTOR and isinstance(options, FaulhaberOptions):
            for speed_mm_s in settings.speeds_mm_s:
                refusing(partial(options.speed, 1e-3 * speed_mm_s))
            problems += _line_problems(settings, options)
    rows, found = _forces(settings, facts)
    tables.append(CheckTable("largest forces", ("what", "value"), rows))
    problems += found
    loop, greatest = settings.force_loop, 1e3 * settings.stiffness.greatest_n_mm
    model = loop.model(loop.law(settings.limits.travel_mm))
    share = f"{greatest / model.largest_stiffness():.2f}, at most 0.50"
    tables.append(CheckTable("force loop", ("what", "value"), (("share of the largest stable gains", share),)))
    refusing(lambda: model.share_used(greatest))
    platform = Platform.of(settings)
    if platform is not None:
        refusing(platform.check)
        corners = ", ".join(f"({1e3 * x:g}, {1e3 * y:g})" for x, y in settings.places.corners_m())
        own = (("manipulator", platform.workspace.delta.title), ("corners of what scenes may ask for", f"{corners} mm"))
        tables.append(CheckTable("places", ("what", "value"), own))
    return RigCheck(tuple(tables), tuple(problems))


def _axis_problems(settings: RigSettings, name: str, options: Any) -> list[str]:
    """Return what would make an axis unsafe."""
    limits, force_n, problems = settings.limits, options.largest_force_n, []
    mandatory = [*_MANDATORY, *(("brake", "counterweight") if options.orientation == "vertical" else ())]
    missing = [option for option in mandatory if getattr(options, option) is None]
    if force_n is None:
        missing.append("peak_force_n (or peak current and force constant)")
    elif name == MOTOR and force_n > limits.rated_force_n:
        problems.append(
            f"The {name}'s drive can exert {force_n:.1f} N, and the weakest part bears {limits.rated_force_n:g} N: "
            "where the force sensor lies, that is the last bound. Lower the peak current."
        )
    if missing:
        problems.append(f"The options of {name} lack {', '.join(missing)}; nothing moves without.")
    if name == MOTOR and options.homes_towards() > 0:
        problems.append(f"The {name} is homed towards the skin. Make homing_speed_m_s negative.")
    if name in JOINTS and options.homes_towards() < 0:
        problems.append(f"The {name} is homed downwards, towards the skin. Make homing_speed_m_s positive.")
    if name == MOTOR and options.corridor_m is not None and options.corridor_m > settings.force_loop.step_m:
        problems.append(
            f"The motor calls a move ended within {1e6 * options.corridor_m:g} um, and the largest increment is "
            f"{1e6 * settings.force_loop.step_m:g} um. Lower corridor_m, or raise the loop's speed."
        )
    return problems


def _axis_rows(options: Any) -> tuple[tuple[str, str], ...]:
    """Return what an axis states."""
    force_n = options.largest_force_n
    without = "holds without power" if options.holds_unpowered else "FALLS without power: it stays powered"
    rows = [
        ("stands", f"{options.orientation or 'not stated'}, {without}"),
        ("largest force of its drive", "not stated" if force_n is None else f"{force_n:.1f} N"),
    ]
    assumed = [name for name in _UNITS if name in type(options).model_fields and name not in options.model_fields_set]
    if assumed:
        rows.append(("units that are ASSUMED", ", ".join(f"{name} {getattr(options, name):g}" for name in assumed)))
    return tuple(rows)


def _line_problems(settings: RigSettings, options: FaulhaberOptions) -> list[str]:
    """Return what is wrong if an increment takes longer on the line than the loop is computed with."""
    loop, exchange_s = settings.force_loop, line_time_s(INCREMENT_BYTES, options.baud)
    if exchange_s <= loop.period_s + 1e-3 * loop.delay_ms:
        return []
    return [
        f"One increment takes {1e3 * exchange_s:.1f} ms on the line; control period and declared delay are "
        f"{1e3 * loop.period_s + loop.delay_ms:g} ms together. Lower rate_hz, state the delay, or raise baud."
    ]


def _forces(
    settings: RigSettings, facts: Mapping[str, PositionerFacts]
) -> tuple[tuple[tuple[str, str], ...], list[str]]:
    """Return how large the force may become, and what is wrong if that is more than is rated or allowed."""
    limits, touch, stiffness, motor = settings.limits, settings.touch, settings.stiffness, facts[MOTOR]
    react_s = WATCH_S + motor.stop_latency_s
    slow, acceleration = 1e-3 * touch.touch_speed_mm_s, 1e-3 * touch.acceleration_mm_s2
    k, soft = 1e3 * stiffness.at_ceiling_n_mm, 1e3 * stiffness.at_touch_n_mm
    by_step = limits.force_ceiling_n + k * (settings.force_loop.step_m + motor.corridor)
    by_approach = largest_force_n(limits.force_ceiling_n, k, slow, acceleration, react_s)
    # A control period, and the mean of a rising force is half its time behind.
    behind_s = settings.force_loop.period_s + 0.5e-3 * touch.mean_ms
    first = min(
        largest_force_n(touch.mean_n, soft, slow, acceleration, react_s + behind_s),
        largest_force_n(touch.single_n, soft, slow, acceleration, react_s + 3e-3),
    )
    rails = [
        largest_force_n(limits.travel_ceiling_n, k, one.speed, one.acceleration, WATCH_S + one.stop_latency_s)
        for name, one in facts.items()
        if name != MOTOR
    ]
    rows = [
        ("reaction", f"{1e3 * react_s:.1f} ms, of which {1e3 * motor.stop_latency_s:.1f} of the motor and its line"),
        ("under force control", f"{by_step:.2f} N: ceiling, one increment and the corridor"),
        ("in an approach that misses the touch", f"{by_approach:.2f} N: ceiling and reaction"),
        ("first touch", f"{first:.2f} N, {touch.allowed_n:g} N are allowed"),
        *([("of a rail that runs down on something", f"{max(rails):.2f} N")] if rails else ()),
    ]
    problems = []
    largest = max(by_step, by_approach, *rails)
    if not largest <= limits.rated_force_n:  # also refuses what is not a number
        problems.append(
            f"The force may come to {largest:.2f} N; the weakest part is rated for {limits.rated_force_n:.2f} N. Lower "
            "the speed, the ceiling or the approach's threshold, or quicken the line."
        )
    if not first <= touch.allowed_n:
        problems.append(
            f"The first touch may come to {first:.2f} N; {touch.allowed_n:g} N are allowed. Lower touch_speed_mm_s, "
            "mean_n or mean_ms."
        )
    return tuple(rows), problems

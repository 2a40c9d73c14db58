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
_STEP = ("LA-12345", "OK\n", "M", "OK\n", "TPOS", "-12345\n", "POS", "-12345\n", "GRC", "1234\n", "OST", "65536\n")
"""Commands of one increment and the look that confirms its end, and their answers, each with a carriage return."""
_MANDATORY = ("lower_m", "upper_m", "speed_m_s", "acceleration_m_s2", "corridor_m")


class _Findings:
    def __init__(self) -> None:
        self.tables: list[CheckTable] = []
        self.problems: list[str] = []

    def table(self, title: str, *rows: tuple[str, str]) -> None:
        self.tables.append(CheckTable(title, ("what", "value"), rows))

    def refusing(self, do: Callable[[], object]) -> None:
        """Keep what `do` raises as a problem."""
        try:
            do()
        except TactbenchError as error:
            self.problems.append(str(error))


def check(file: RigFile) -> RigCheck:
    """Return what axes, loop, forces and places come to, and what is refused.

    Raises
    ------
    UsageError, UnknownNameError
        If the file lacks something, or names what is not installed.
    """
    found = _found(file)
    return RigCheck(tuple(found.tables), tuple(found.problems))


def refuse(file: RigFile) -> None:
    """Raise UsageError if a rig file is refused for what it says; raises as :func:`check` as well."""
    problems = _found(file).problems
    if problems:
        raise UsageError(
            f"The rig file is refused: {problems[0]}",
            hint="`tactbench doctor --rig-file FILE --seconds 0` says all that it would do.",
        )


def _found(file: RigFile) -> _Findings:
    settings, registry = settings_of(file), load_registry()
    file = with_limits(file, settings, registry)
    found = _Findings()
    facts = {}
    for name in axes_of(settings):
        kind, given = positioner_of(registry, name, file.devices[name])
        options = read_options(kind.options_kind, given, name)
        try:
            facts[name] = kind.facts_of(options)
        except RigError as error:
            raise UsageError(f"{name}: {error.message}", hint=error.hint) from error
        _axis(found, settings, name, options)
    motor = facts[MOTOR]
    if motor.corridor > settings.force_loop.step_m:
        found.problems.append(
            f"The motor calls a move ended within {1e6 * motor.corridor:g} um, and the largest increment is "
            f"{1e6 * settings.force_loop.step_m:g} um. Lower corridor_m, or raise the loop's speed."
        )
    _loop(found, settings)
    _forces(found, settings, facts)
    _places(found, settings)
    return found


def _axis(found: _Findings, settings: RigSettings, name: str, options: Any) -> None:
    """Say what an axis states, and refuse what would make it unsafe."""
    limits = settings.limits
    missing = [option for option in _MANDATORY if getattr(options, option) is None]
    if options.orientation is None:
        missing.append("orientation")
    elif options.orientation == "vertical":
        missing += [option for option in ("brake", "counterweight") if getattr(options, option) is None]
    force_n = options.largest_force_n
    if force_n is None:
        missing.append("peak_force_n (or peak current and force constant)")
    elif name == MOTOR and force_n > limits.rated_force_n:
        found.problems.append(
            f"The {name}'s drive can exert {force_n:.1f} N, and the weakest part bears {limits.rated_force_n:g} N: "
            "where the force sensor lies, that is the last bound. Lower the peak current."
        )
    if missing:
        found.problems.append(f"The options of {name} lack {', '.join(missing)}; nothing moves without.")
    if name == MOTOR and options.homes_towards() > 0:
        found.problems.append(f"The {name} is homed towards the skin. Make homing_speed_m_s negative.")
    if name in JOINTS and options.homes_towards() < 0:
        found.problems.append(f"The {name} is homed downwards, towards the skin. Make homing_speed_m_s positive.")
    without = "holds without power" if options.holds_unpowered else "FALLS without power: it stays powered"
    rows = [
        ("stands", f"{options.orientation or 'not stated'}, {without}"),
        ("largest force of its drive", "not stated" if force_n is None else f"{force_n:.1f} N"),
    ]
    if isinstance(options, FaulhaberOptions):
        rows += _units(found, settings if name == MOTOR else None, options)
    found.table(name, *rows)


def _units(found: _Findings, settings: RigSettings | None, options: FaulhaberOptions) -> list[tuple[str, str]]:
    """Return what the drive's integers mean; refuse speeds of a press that it does not have."""
    rows = []
    for what, name, factor, unit in (
        ("increment", "increment_m", 1e6, "um"), ("unit of speed", "speed_unit_m_s", 1e3, "mm/s"),
        ("unit of acceleration", "acceleration_unit_m_s2", 1e3, "mm/s^2"),
        ("unit of current", "current_unit_a", 1e3, "mA"),
    ):  # fmt: skip
        by = "" if name in options.model_fields_set else " (ASSUMED)"
        rows.append((what, f"{factor * getattr(options, name):g} {unit}{by}"))
    if settings is not None:
        touch = settings.touch
        for name, speed_mm_s in (
            ("touch speed_mm_s", touch.speed_mm_s), ("touch touch_speed_mm_s", touch.touch_speed_mm_s),
            ("press unload_speed_mm_s", settings.press.unload_speed_mm_s),
            ("limits retreat_speed_mm_s", settings.limits.retreat_speed_mm_s),
        ):  # fmt: skip
            found.refusing(partial(_has_speed, options, name, speed_mm_s))
        # Of each line one end is in the text already, or is a carriage return.
        exchange_s = sum(line_time_s(len(text) + 1, options.baud) for text in _STEP)
        loop = settings.force_loop
        rows.append(("one increment and its look", f"{1e3 * exchange_s:.1f} ms on the line"))
        if exchange_s > loop.period_s + 1e-3 * loop.delay_ms:
            found.problems.append(
                f"One increment takes {1e3 * exchange_s:.1f} ms on the line; control period and declared delay are "
                f"{1e3 * loop.period_s + loop.delay_ms:g} ms together. Lower rate_hz, state the delay, or raise baud."
            )
    return rows


def _has_speed(options: FaulhaberOptions, name: str, speed_mm_s: float) -> None:
    unit_mm_s = 1e3 * options.speed_unit_m_s
    got_mm_s = unit_mm_s * options.speed(1e-3 * speed_mm_s)
    if got_mm_s < 0.9 * speed_mm_s:
        raise UsageError(
            f"{name} of {speed_mm_s:g} mm/s would be {got_mm_s:g} mm/s: the drive's unit is {unit_mm_s:g} mm/s.",
            hint="State another speed, or the drive's own unit under `options: speed_unit_m_s`.",
        )


def _loop(found: _Findings, settings: RigSettings) -> None:
    """Say how far the gains are from swinging, and refuse more than half."""
    stiffness = settings.stiffness
    model = settings.force_loop.model(settings.force_loop.law(settings.limits.travel_mm))
    greatest = 1e3 * stiffness.greatest_n_mm
    found.table(
        "force loop",
        ("declared stiffness", f"{stiffness.least_n_mm:g} to {stiffness.greatest_n_mm:g} N/mm, "
         f"{stiffness.at_touch_n_mm:g} at a touch, {stiffness.at_ceiling_n_mm:g} at the ceiling"),
        ("share of the largest stable gains", f"{greatest / model.largest_stiffness():.2f}, at most 0.50"),
    )  # fmt: skip
    found.refusing(lambda: model.share_used(greatest))


def _forces(found: _Findings, settings: RigSettings, facts: Mapping[str, PositionerFacts]) -> None:
    """Say how large the force may become, and refuse more than what is rated or allowed."""
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
    found.table(
        "largest forces",
        ("reaction", f"{1e3 * react_s:.1f} ms, of which {1e3 * motor.stop_latency_s:.1f} of the motor and its line"),
        ("under force control", f"{by_step:.2f} N: ceiling, one increment and the corridor"),
        ("in an approach that misses the touch", f"{by_approach:.2f} N: ceiling and reaction"),
        ("first touch", f"{first:.2f} N, {touch.allowed_n:g} N are allowed"),
    )
    rails = [
        largest_force_n(limits.travel_ceiling_n, k, one.speed, one.acceleration, WATCH_S + one.stop_latency_s)
        for name, one in facts.items()
        if name != MOTOR
    ]
    if rails:
        found.table("largest forces of the rails", ("of a rail that runs down on something", f"{max(rails):.2f} N"))
    largest = max(by_step, by_approach, *rails)
    if not largest <= limits.rated_force_n:  # also refuses what is not a number
        found.problems.append(
            f"The force may come to {largest:.2f} N; the weakest part is rated for {limits.rated_force_n:.2f} N. Lower "
            "the speed, the ceiling or the approach's threshold, or quicken the line."
        )
    if not first <= touch.allowed_n:
        found.problems.append(
            f"The first touch may come to {first:.2f} N; {touch.allowed_n:g} N are allowed. Lower touch_speed_mm_s, "
            "mean_n or mean_ms."
        )


def _places(found: _Findings, settings: RigSettings) -> None:
    """Say where the manipulator would go."""
    platform = Platform.of(settings)
    if platform is None:
        return
    found.refusing(platform.check)
    heights = settings.heights
    corners = ", ".join(f"({1e3 * x:g}, {1e3 * y:g})" for x, y in settings.places.corners_m())
    found.table(
        "places",
        ("manipulator", platform.workspace.delta.title),
        ("corners of what scenes may ask for", f"{corners} mm"),
        ("stand-off, clearance plane", f"{1e3 * heights.stand_off_m:g}, {1e3 * heights.clearance_m:g} mm"),
    )

"""What a rig file would let this rig do, and why it would be refused; nothing is opened and nothing moves.

The first bytes are those that the drivers send to emulated devices in the process, in virtual time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from tactbench.plugin import TactbenchError, UsageError, load_registry
from tactbench.plugin.devices import (
    CanFrame,
    CheckTable,
    DeviceEntry,
    EmulatedDevices,
    LoopModel,
    PressingForce,
    RigCheck,
    RigFile,
    drivers_of,
    emulators_of,
)
from tactbench.rigs.parallel_manipulator.guard import LONGEST_COMMAND, MANDATORY, reaction
from tactbench.rigs.parallel_manipulator.joints import check_places, workspace_of
from tactbench.rigs.parallel_manipulator.motor.codec import line_time_s
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions, MotorProfile
from tactbench.rigs.parallel_manipulator.options import read_options
from tactbench.rigs.parallel_manipulator.settings import JOINTS, MOTOR, RigSettings, settings_of, with_limits
from tactbench.rigs.parallel_manipulator.worst_case import (
    check_largest_force,
    first_touch_n,
    largest_force_n,
)

if TYPE_CHECKING:
    from tactbench.plugin.devices import Link
    from tactbench.rigs.parallel_manipulator.worst_case import Reaction

FIRST = 4
"""Pieces shown of what is sent to a device."""
MOST_BYTES = 24
"""Bytes shown of each."""
_STEP = ("LR-1234", "OK\n", "M", "OK\n", "TPOS", "-12345\n", "POS", "-12345\n", "GRC", "1234\n", "OST", "65536\n")
"""Commands of one increment and the look that confirms its end, and their answers, each with a carriage return."""

_Entry = TypeVar("_Entry", bound=DeviceEntry)


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
    """Return limits, units, times, forces and first bytes, and what is refused.

    Raises
    ------
    UsageError, UnknownNameError
        If the file lacks something, or names what is not installed.
    """
    found = _found(file)
    _first_bytes(found, with_limits(file, settings_of(file)))
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
    settings = settings_of(file)
    file = with_limits(file, settings)
    options = read_options(FaulhaberOptions, file.devices[MOTOR].options, "faulhaber")
    found = _Findings()
    _limits(found, settings)
    _units(found, settings, options)
    react = _times(found, settings, options)
    _loop(found, settings)
    _forces(found, settings, react)
    _places(found, settings)
    return found


def _limits(found: _Findings, settings: RigSettings) -> None:
    limits, heights = settings.limits, settings.heights
    low, high = limits.travel_mm
    beats = 1e-3 * limits.heartbeat_ms * settings.force_loop.rate_hz
    torque = "not looked at" if limits.torque_ceiling_nm is None else f"{limits.torque_ceiling_nm:g} N m"
    found.table(
        "limits",
        ("force ceiling", f"{limits.force_ceiling_n:g} N, of the norm of one raw sample"),
        ("torque ceiling", torque),
        ("rated force of the weakest part", f"{limits.rated_force_n:g} N"),
        ("travel of the motor", f"{low:g} to {high:g} mm"),
        ("retreats to", f"{limits.retreat_mm:g} mm at {limits.retreat_speed_mm_s:g} mm/s"),
        ("heartbeat", f"{limits.heartbeat_ms:g} ms, {beats:.1f} control periods"),
        ("skin expected at", f"{1e3 * settings.surface_m:g} mm, standard deviation {heights.surface_spread_mm:g} mm"),
        ("goes no deeper than", f"{1e3 * settings.deepest_m:g} mm"),
        ("homing ends at", f"{limits.homing_force_n:g} N"),
    )  # fmt: skip


def _units(found: _Findings, settings: RigSettings, options: FaulhaberOptions) -> None:
    """Say what the drive's integers mean, and refuse speeds and steps that it does not have."""
    profile, touch = options.profile(), settings.touch
    stated = profile.model_fields_set

    def unit(name: str, shown: str) -> str:
        quantity = getattr(profile, name)
        by = "the rig file" if name in stated else f"ASSUMED: {quantity.source.reference}"
        return f"{quantity.to(shown):g} {shown} ({by})"

    found.table(
        "units of the motor's drive",
        ("one increment", unit("position_unit", "um")),
        ("one unit of speed", unit("speed_unit", "mm/s")),
        ("one unit of acceleration", unit("acceleration_unit", "mm/s/s")),
        ("one unit of current", unit("current_unit", "mA")),
    )
    missing = [name for name in MANDATORY if getattr(options, name) is None]
    if missing:
        found.problems.append(
            f"The motor's options lack {', '.join(missing)}; the guard does not arm without. Add them under `options:`."
        )
    for name, speed in (
        ("touch speed_mm_s", touch.speed_mm_s),
        ("touch touch_speed_mm_s", touch.touch_speed_mm_s),
        ("press unload_speed_mm_s", settings.press.unload_speed_mm_s),
        ("limits retreat_speed_mm_s", settings.limits.retreat_speed_mm_s),
    ):
        found.refusing(partial(_has_speed, profile, name, speed))
    if options.corridor_m is not None and options.corridor_m > settings.force_loop.step_m:
        found.problems.append(
            f"The drive calls a move ended within {1e6 * options.corridor_m:g} um, and the largest increment is "
            f"{1e6 * settings.force_loop.step_m:g} um. Lower corridor_m, or raise the loop's speed."
        )


def _has_speed(profile: MotorProfile, name: str, speed_mm_s: float) -> None:
    requested, unit = 1e-3 * speed_mm_s, profile.speed_unit.to("m/s")
    got = profile.speed_m_s(profile.speed(requested))
    if got < 0.9 * requested:
        raise UsageError(
            f"{name} of {speed_mm_s:g} mm/s would be {1e3 * got:g} mm/s: the drive's unit is {1e3 * unit:g} mm/s.",
            hint="State another speed, or the drive's own unit under `options: speed_unit_m_s`.",
        )


def _times(found: _Findings, settings: RigSettings, options: FaulhaberOptions) -> Reaction:
    """Say how long bytes take, and refuse a control period in which no increment passes."""
    loop = settings.force_loop
    # Of each line one end is in the text already, or is a carriage return.
    exchange_s = sum(line_time_s(len(text) + 1, options.baud) for text in _STEP)
    react = reaction(options, motor_lag_s=1e-3 * loop.motor_lag_ms)
    found.table(
        f"times on the motor's line, {options.baud} baud",
        ("one increment and its look", f"{1e3 * exchange_s:.1f} ms and six answer times of the drive"),
        ("control period", f"{1e3 * loop.period_s:g} ms"),
        ("declared delay, lag of the motor", f"{loop.delay_ms:g}, {loop.motor_lag_ms:g} ms"),
        ("largest increment", f"{1e6 * loop.step_m:g} um"),
        ("reaction", f"{1e3 * react.time_s:.1f} ms: force {1e3 * react.force_age_s:g}, scheduling "
         f"{1e3 * react.scheduling_s:g}, up to {LONGEST_COMMAND} bytes ahead and {react.stop_bytes} of the retreat, "
         f"lag {1e3 * react.motor_lag_s:g}"),
        ("a rig that hangs", f"{settings.limits.heartbeat_ms + 1e3 * react.time_s:.1f} ms until the motor brakes"),
    )  # fmt: skip
    if exchange_s > loop.period_s + 1e-3 * loop.delay_ms:
        found.problems.append(
            f"One increment takes {1e3 * exchange_s:.1f} ms on the line; control period and declared delay are "
            f"{1e3 * loop.period_s + loop.delay_ms:g} ms together. Lower rate_hz, state the delay, or raise baud."
        )
    return react


def _loop(found: _Findings, settings: RigSettings) -> None:
    """Say how far the gains are from swinging, and refuse more than half."""
    loop, stiffness = settings.force_loop.loop(), settings.stiffness
    if settings.force_loop.integral_mm_n_s == 0 and settings.force_loop.proportional_mm_n == 0:
        found.problems.append("The force loop has no gain. State integral_mm_n_s.")
        return
    model, greatest = LoopModel.of(loop), 1e3 * stiffness.greatest_n_mm
    found.table(
        "force loop",
        ("declared stiffness", f"{stiffness.least_n_mm:g} to {stiffness.greatest_n_mm:g} N/mm, "
         f"{stiffness.at_touch_n_mm:g} at a touch, {stiffness.at_ceiling_n_mm:g} at the ceiling"),
        ("share of the largest stable gains", f"{greatest / model.largest_stiffness():.2f}, at most 0.50"),
    )  # fmt: skip
    found.refusing(lambda: model.share_used(greatest))


def _forces(found: _Findings, settings: RigSettings, react: Reaction) -> None:
    """Say how large the force may become, and refuse more than what is rated or allowed."""
    limits, touch, stiffness = settings.limits, settings.touch, settings.stiffness
    k, acceleration = 1e3 * stiffness.at_ceiling_n_mm, 1e-3 * touch.acceleration_mm_s2
    by_step = limits.force_ceiling_n + k * settings.force_loop.step_m
    by_touch = largest_force_n(limits.force_ceiling_n, k, 1e-3 * touch.touch_speed_mm_s, acceleration, react)
    soft, slow = 1e3 * stiffness.at_touch_n_mm, 1e-3 * touch.touch_speed_mm_s
    # The mean of a rising force is half its time behind.
    behind_s = react.time_s + 0.5e-3 * touch.mean_ms
    first = first_touch_n(touch.mean_n, soft, slow, acceleration, settings.force_loop.period_s, behind_s)
    single = first_touch_n(touch.single_n, soft, slow, acceleration, react.force_age_s, react.time_s, samples=3)
    found.table(
        "largest forces",
        ("under force control", f"{by_step:.2f} N: ceiling, and one increment at {stiffness.at_ceiling_n_mm:g} N/mm"),
        ("in an approach that misses the touch", f"{by_touch:.2f} N: ceiling, {1e3 * react.time_s:.1f} ms of reaction"),
        ("first touch, found by the mean", f"{first:.2f} N at {stiffness.at_touch_n_mm:g} N/mm"),
        ("first touch, found by single samples", f"{single:.2f} N"),
    )
    for what, largest in (("Under force control", by_step), ("In the approach", by_touch)):
        found.refusing(partial(check_largest_force, largest, limits.rated_force_n, f"{what.lower()}, the weakest part"))
    largest = min(first, single)
    if largest > touch.allowed_n:
        found.problems.append(
            f"The first touch may come to {largest:.2f} N; {touch.allowed_n:g} N are allowed. Lower touch_speed_mm_s, "
            "mean_n or mean_ms."
        )


def _places(found: _Findings, settings: RigSettings) -> None:
    """Say where the manipulator would go."""
    try:
        workspace = workspace_of(settings)
        check_places(settings)
    except TactbenchError as error:
        found.problems.append(str(error))
        return
    if workspace is None:
        found.table("places", ("manipulator", "fixed: somebody puts the sensor below the indenter"))
        return
    heights = settings.heights.heights()
    corners = ", ".join(f"({1e3 * x:g}, {1e3 * y:g})" for x, y in settings.places.corners_m())
    found.table(
        "places",
        ("manipulator", workspace.delta.title),
        ("corners of what scenes may ask for", f"{corners} mm"),
        ("stand-off, clearance plane", f"{1e3 * heights.stand_off_m:g}, {1e3 * heights.clearance_m:g} mm"),
        ("all moves between them", "permitted"),
    )


def _first_bytes(found: _Findings, file: RigFile) -> None:
    """Say what each device would be sent first: who it is, and its settings; of motors nothing that moves."""
    rows: list[tuple[str, ...]] = []
    for sensor in file.sensors:
        entries = file.entries()
        names = [sensor] if rows else [sensor, "force", MOTOR, *(name for name in JOINTS if name in entries)]
        emulated = file.model_copy(
            update={
                "sensors": {sensor: _emulated(file.sensors[sensor])},
                "force": None if file.force is None else _emulated(file.force),
                "devices": {name: _emulated(entry) for name, entry in file.devices.items()},
            }
        )
        registry = load_registry()
        for name in names:
            try:
                emulators = emulators_of(emulated, registry, sensor, lambda t_s: {})
                with EmulatedDevices({name: emulators[name]}, keep_log=True) as devices:
                    links: dict[str, Callable[[], Link]] = {name: devices.opener(name)}
                    driver = drivers_of(emulated, registry, sensor, links, devices.clock, (name,))[name]
                    with driver:
                        driver.identify()
                        driver.start()
                        if name == "force" and file.force is not None:
                            PressingForce(file.force, driver.streams)
                    sent = [passed.piece for passed in devices.log_of(name) if passed.sender == "host"]
            except TactbenchError as error:
                found.problems.append(str(error))
                continue
            rows.append((name, entries[name].link, "  ".join(_shown(piece) for piece in sent[:FIRST])))
    title = "sent first, by the drivers to emulated devices"
    found.tables.append(CheckTable(title, ("device", "link", "bytes"), tuple(rows)))


def _emulated(entry: _Entry) -> _Entry:
    return entry.model_copy(update={"link": "emulated", "faults": ()})


def _shown(piece: object) -> str:
    """Return a piece as text where it is text, else its bytes; a CAN frame as number and bytes."""
    if isinstance(piece, CanFrame):
        return f"{piece.id:X}#{piece.data.hex(' ').upper()}"
    assert isinstance(piece, bytes)
    if piece.endswith(b"\r") and piece.isascii():
        return repr(piece.decode("ascii")).strip("'")
    text = piece[:MOST_BYTES].hex(" ").upper()
    return f"{text} … ({len(piece)} bytes)" if len(piece) > MOST_BYTES else text

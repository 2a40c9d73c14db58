"""Checks of force sensors and motors: on their emulators in virtual time, as a rig uses them.

What they have in common with a sensor's driver is in ``driver.py``. How a motor is moved, each rig says for itself:
a rig is checked with it by `--rig-file`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import check, code_of, fail, skip
from tactbench.core.conformance.driver import BAD, WAIT_S, blocks_of, emulated, marks_of, rows_of
from tactbench.core.conformance.subject import Subject
from tactbench.core.samples import Quality
from tactbench.core.spec.sensor import ChannelSpec

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray
    from tactbench.devices.driver import Driver

LOAD_N = 0.5
"""Of the first force channel, and as much more of each further one: different for each, and small for any sensor."""
READ_SHARE = 0.02
"""By which a reading may be off (assumed: sensors are calibrated to 1 %, and their converters add a step)."""
READ_N = 0.02
"""And by so much beside that: a step of a converter and its noise."""
OVERLOAD_N = 1e6
"""More than any sensor of a fingertip bears."""
STILL_M = 1e-5
"""By which the position of a motor at rest may change (assumed: an increment of its drive, twice)."""


def _of_kind(subject: Subject, kind: str) -> None:
    if subject.descriptor.kind != kind:
        skip(f"it is a {subject.descriptor.kind} device, no {kind} device")


def _forces(driver: Driver) -> list[ChannelSpec]:
    return [channel for stream in driver.streams for channel in stream.channels if channel.kind == "force"]


class _Load:
    """What a device senses: nothing until `values` are set. Some drivers take their zero when they start."""

    def __init__(self) -> None:
        self.values: Mapping[str, float] = {}

    def __call__(self, _t_s: float) -> Mapping[str, float]:
        return self.values


@contextmanager
def _loaded(
    subject: Subject, loads: Mapping[str, float] | None = None
) -> Iterator[tuple[Driver, Any, dict[str, float]]]:
    """Start the driver without load, then put on `loads`, by channel [N]; yield it, the clock and the loads.

    Without `loads`, one for each force channel, with both signs.
    """
    load = _Load()
    with emulated(subject, senses=load) as (driver, _, clock):
        with code_of("driver.start", subject.package):
            driver.start()
        own = dict(_loads(driver) if loads is None else loads)
        load.values = own
        driver.read(WAIT_S)
        yield driver, clock, own


def _loads(driver: Driver) -> dict[str, float]:
    """Return a load for each force channel, with both signs [N]."""
    return {one.name: LOAD_N * (n + 1) * (-1.0) ** n for n, one in enumerate(_forces(driver))}


def _medians(driver: Driver, clock: Any) -> dict[str, float]:
    """Read for `READ_S`; return the median of each channel over the second half, without samples that are marked."""
    import numpy as np

    rows = rows_of(driver, clock)
    found: dict[str, float] = {}
    for stream in driver.streams:
        table = rows[stream.name]
        found |= dict(
            zip((one.name for one in stream.channels), np.nanmedian(table[len(table) // 2 :], axis=0), strict=True)
        )
    return found


@check("device", needs=("driver-opens",), level="silver")
def force_is_in_newtons(subject: Subject) -> None:
    """A rig's force loop, its ceilings and every score of force take the channel of kind ``force`` for newtons.

    Give each force channel kind "force" and unit "N", each torque channel kind "torque" and unit "N*m", and convert.
    """
    _of_kind(subject, "force")
    with emulated(subject) as (driver, _, _):
        if not _forces(driver):
            fail("driver.streams", "none of its channels is of kind force")
        for stream in driver.streams:
            for channel in stream.channels:
                unit = {"force": "N", "torque": "N*m"}.get(channel.kind, channel.unit)
                if channel.unit != unit:
                    fail(
                        f"driver.streams[{stream.name}].channels[{channel.name}].unit",
                        f"{channel.unit!r}, not {unit!r}",
                    )


@check("device", needs=("driver-reads", "force-is-in-newtons"), level="silver")
def force_is_what_is_sensed(subject: Subject) -> None:
    """Axes that are swapped, a lost sign or gram-force give plausible forces, and a rig presses by them.

    Decode into the order of the stream's channels, in newtons and with the sign that the emulator's senses have.
    """
    _of_kind(subject, "force")
    with _loaded(subject) as (driver, clock, loads):
        found = _medians(driver, clock)
    for name, load in loads.items():
        if abs(found[name] - load) > READ_N + READ_SHARE * abs(load):
            others = [one for one, value in loads.items() if abs(found[name] - value) <= READ_N]
            factor = found[name] / load
            meant = (
                f", which is what {others[0]} senses" if others
                else ": is its sign turned?" if abs(factor + 1) < READ_SHARE
                else ": are these gram-force?" if 80 < abs(factor) < 125
                else ""
            )  # fmt: skip
            fail(f"driver.read: {name}", f"{found[name]:.4g} N where {load:g} N are sensed{meant}")


@check("device", needs=("force-is-what-is-sensed",), level="silver")
def tare_takes_the_load_as_zero(subject: Subject) -> None:
    """A driver that says it has taken a zero, and has not, presses harder by the load that was there.

    Return True from tare() only where the device itself takes its present reading as zero.
    """
    _of_kind(subject, "force")
    with _loaded(subject) as (driver, clock, loads):
        with code_of("driver.tare", subject.package):
            taken = driver.tare()
        if not taken:
            skip("it takes no zero itself: a rig subtracts its own")
        found = _medians(driver, clock)
    for name, load in loads.items():
        if abs(found[name]) > READ_N + READ_SHARE * abs(load):
            fail("driver.tare", f"it says that a zero is taken, and {name} reads {found[name]:.4g} N of {load:g} N")


@check("device", needs=("driver-reads", "force-is-in-newtons"), level="silver")
def overload_is_marked(subject: Subject) -> None:
    """A sensor at the end of its range reads a number like any other, and a force loop goes on pressing by it.

    Mark such samples as Quality.SATURATED, and let the emulator stop at the end of the sensor's range.
    """
    import numpy as np

    _of_kind(subject, "force")
    with emulated(subject) as (driver, _, _):
        loads = {one.name: OVERLOAD_N for one in _forces(driver)}
    with _loaded(subject, loads) as (driver, clock, _):
        rows: dict[str, list[Any]] = {stream.name: [] for stream in driver.streams}
        for block in blocks_of(driver, clock):
            marked = (marks_of(block) & (Quality.SATURATED | BAD)) != 0
            rows[block.stream].append(marked | ~np.isfinite(block.data))
        for stream in driver.streams:
            marked = np.concatenate(rows[stream.name])
            for column, channel in enumerate(stream.channels):
                if channel.kind == "force" and not marked[len(marked) // 2 :, column].all():  # a filter may take time
                    where = f"driver.read: {stream.name}.{channel.name}"
                    fail(where, f"it is not marked SATURATED under {OVERLOAD_N:g} N")


def _positions(driver: Driver) -> Mapping[str, tuple[str, int]]:
    """Return stream and column of each channel of kind position, by its name."""
    return {
        channel.name: (stream.name, column)
        for stream in driver.streams
        for column, channel in enumerate(stream.channels)
        if channel.kind == "position"
    }


@check("device", needs=("driver-opens",), level="silver")
def position_is_in_metres(subject: Subject) -> None:
    """Ends of travel and places to retreat to are compared with a motor's position: a thousand times off, none holds.

    Give a motor a stream with a channel `position` of kind "position" and unit "m", and convert its increments.
    """
    _of_kind(subject, "motor")
    with emulated(subject) as (driver, _, _):
        if not _positions(driver):
            fail("driver.streams", "none of its channels is of kind position")
        for stream in driver.streams:
            for channel in stream.channels:
                if channel.kind == "position" and channel.unit != "m":
                    where = f"driver.streams[{stream.name}].channels[{channel.name}].unit"
                    fail(where, f"{channel.unit!r}, and 'm' is needed")


@check("device", needs=("driver-reads", "position-is-in-metres"), level="silver")
def opening_and_reading_move_nothing(subject: Subject) -> None:
    """A motor that runs off when its line is opened does so with a finger under it, and no guard is there yet.

    Leave the motor where it is, and without power, in the driver's making, identify(), start() and read().
    """
    import numpy as np

    _of_kind(subject, "motor")
    with emulated(subject) as (driver, _, clock):
        rows: dict[str, list[FloatArray]] = {stream.name: [] for stream in driver.streams}
        driver.identify()
        driver.start()
        for block in blocks_of(driver, clock):
            rows[block.stream].append(np.asarray(block.data, dtype=np.float64))
        for name, (stream, column) in _positions(driver).items():
            found = np.concatenate(rows[stream])[:, column]
            found = found[np.isfinite(found)]
            if len(found) and np.ptp(found) > STILL_M:
                fail(f"driver.read: {name}", f"it changes by {1e3 * np.ptp(found):.3g} mm, and nobody has moved it")


CHECKS = (
    force_is_in_newtons, force_is_what_is_sensed, tare_takes_the_load_as_zero, overload_is_marked,
    position_is_in_metres, opening_and_reading_move_nothing,
)  # fmt: skip

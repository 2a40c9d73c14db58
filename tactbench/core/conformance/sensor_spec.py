"""Checks of what a sensor says of itself: streams, ranges, places, nuisances. No code of its own runs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactbench.core.conformance.check import check, fail, skip
from tactbench.core.conformance.common import difference
from tactbench.core.conformance.geometry import on_sheet_mm, sheet_of
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import TactbenchError, UsageError
from tactbench.core.spec import units
from tactbench.core.spec.sensor import ChannelSpec, SensorSpec, StreamSpec

LARGEST_SENSOR_M = 1.0
"""Every position is less than this from the sensor's origin: a skin of a forearm is 0.3 m, and millimetres given as
metres are beyond it for all but the smallest."""
OF_KIND = {
    "force": "N", "torque": "N*m", "position": "m", "dc_pressure": "Pa", "ac_pressure": "Pa", "dc_temperature": "K",
    "joint": "rad",
}  # fmt: skip
"""A unit of what a kind of channel measures."""
_EDGE_MM = 1e-6
"""Rounding of a position in metres."""
_UNIT_NORMAL = 1e-3
"""Data sheets state normals to three decimals."""


def _channels(spec: SensorSpec) -> Iterator[tuple[str, StreamSpec, ChannelSpec]]:
    for stream in spec.streams:
        for channel in stream.channels:
            yield f"spec.streams[{stream.name}].channels[{channel.name}]", stream, channel


@check("sensor", needs=("json-round-trip",))
def hdf5_round_trip(subject: Subject) -> None:
    """A recording holds the whole spec and every stream, beside the stream ``force_torque`` of a rig.

    Give streams other names than ``force_torque``, and types that hold their own limits.
    """
    import numpy as np

    from tactbench.core.recording.reader import open_recording
    from tactbench.core.recording.writer import RecordingWriter
    from tactbench.core.samples import Block
    from tactbench.core.spec.recording import RecordingMeta

    spec = subject.descriptor.spec
    reference = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
    if any(stream.name == reference.name for stream in spec.streams):
        fail(f"spec.streams[{reference.name}].name", "it is the name of the stream of a rig's force sensor")
    meta = RecordingMeta(name="round-trip", sensor=spec, reference=(reference,), rig="none", clock="nominal")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "round-trip.h5"
        try:
            with RecordingWriter(path, meta) as writer:
                t_ns = np.zeros(1, dtype=np.int64)
                for stream in (*spec.streams, reference):
                    row = np.zeros((1, len(stream.channels)), dtype=stream.dtype)
                    writer.append(Block(stream.name, t_ns, row))
            with open_recording(path) as recording:
                back = recording.meta.sensor
                names = recording.stream_names
        except TactbenchError as error:
            fail("spec.streams", f"a recording of it cannot be written and read back: {error}")
    place = difference(spec.model_dump(), back.model_dump())
    if place:
        fail(f"spec.{place}", "it is another value after a round trip through a recording")
    if set(names) != {stream.name for stream in (*spec.streams, reference)}:
        fail("spec.streams", f"a recording of it holds {', '.join(names)} only")


@check("sensor")
def limits_are_in_order(subject: Subject) -> None:
    """Saturation, table tolerances and plots are told from lower, rest and upper.

    State lower < upper and a rest level between them, in a unit that can be turned into the channel's.
    """
    for place, _, channel in _channels(subject.descriptor.spec):
        low = -math.inf if channel.lower is None else channel.lower
        high = math.inf if channel.upper is None else channel.upper
        if not low < high:
            fail(f"{place}.lower", f"{low:g} is not below upper, {high:g}")
        if channel.rest is None:
            continue
        try:
            rest = channel.rest.to(channel.unit)
        except UsageError:
            fail(
                f"{place}.rest", f"its unit {channel.rest.unit!r} cannot be turned into the channel's {channel.unit!r}"
            )
        if not low <= rest <= high:
            fail(f"{place}.rest", f"{rest:g} {channel.unit} is not within {low:g} to {high:g}")


@check("sensor")
def limits_fit_the_type(subject: Subject) -> None:
    """A limit that the stored type cannot hold is never reached: saturation would pass unseen, or wrap.

    Choose a dtype that holds lower and upper, or correct the limits.
    """
    import numpy as np

    for place, stream, channel in _channels(subject.descriptor.spec):
        if np.dtype(stream.dtype).kind == "f":
            continue
        info = np.iinfo(stream.dtype)
        for field, limit in (("lower", channel.lower), ("upper", channel.upper)):
            if limit is not None and not info.min <= limit <= info.max:
                fail(f"{place}.{field}", f"{limit:g} does not fit {stream.dtype} ({info.min} to {info.max})")


@check("sensor", may_skip=True)
def saturation_is_declared(subject: Subject) -> None:
    """Whole numbers come from a converter, and without its ends nobody can tell a full reading from a clipped one.

    State lower and upper of every channel whose stream stores whole numbers.
    """
    import numpy as np

    counted = [one for one in _channels(subject.descriptor.spec) if np.dtype(one[1].dtype).kind in "iu"]
    if not counted:
        skip("none of its streams stores whole numbers")
    for place, _, channel in counted:
        for field, limit in (("lower", channel.lower), ("upper", channel.upper)):
            if limit is None:
                fail(f"{place}.{field}", "its stream stores whole numbers, and the converter's end is not stated")


@check("sensor")
def units_are_of_the_kind(subject: Subject) -> None:
    """A task asks for kinds of channels and relies on their dimension: a force is a force, whatever its unit.

    Give force, torque, position and pressure channels a unit of that dimension, or ``count`` for raw readings.
    """
    for place, _, channel in _channels(subject.descriptor.spec):
        unit = OF_KIND.get(channel.kind)
        if unit is None or channel.unit in ("count", "V", "mV"):
            continue
        if units.parse(channel.unit)[1] != units.parse(unit)[1]:
            fail(f"{place}.unit", f"a {channel.kind} is measured in {unit} or count, not in {channel.unit}")


@check("sensor")
def positions_are_complete(subject: Subject) -> None:
    """With some taxels in unknown places, maps have holes and the twin cannot press them.

    State position_m of every taxel, or of none.
    """
    spec = subject.descriptor.spec
    taxels = [one for one in _channels(spec) if one[2].kind == "taxel"]
    without = [place for place, _, channel in taxels if channel.position_m is None]
    if without and len(without) < len(taxels):
        fail(f"{without[0]}.position_m", f"{len(without)} of {len(taxels)} taxels have no place, the others have")


@check("sensor", may_skip=True)
def positions_are_in_metres(subject: Subject) -> None:
    """Places are in metres; millimetres make a fingertip the size of a room.

    Divide position_m by 1000.
    """
    placed = [(place, one) for place, _, one in _channels(subject.descriptor.spec) if one.position_m is not None]
    if not placed:
        skip("it states no place of any channel")
    for place, channel in placed:
        far = max(abs(part) for part in channel.position_m or ())
        if not far < LARGEST_SENSOR_M:
            fail(f"{place}.position_m", f"{far:g} m from the sensor's origin; were millimetres meant?")


@check("sensor", needs=("positions-are-in-metres",))
def positions_are_apart(subject: Subject) -> None:
    """Two taxels in one place are usually a copied line.

    Correct position_m of one of them, or name the `site` that both belong to.
    """
    places: dict[tuple[float, ...], tuple[str, str]] = {}
    for place, _, channel in _channels(subject.descriptor.spec):
        if channel.kind == "taxel" and channel.position_m is not None:
            site = channel.site or place
            first, known = places.setdefault(channel.position_m, (place, site))
            if known != site:
                fail(f"{place}.position_m", f"it is also that of {first.rpartition('[')[2].rstrip(']')}")


@check("sensor", needs=("positions-are-in-metres",))
def positions_are_on_the_sheet(subject: Subject) -> None:
    """A taxel off the skin's sheet is pressed by nothing, or by its periodic image on the other side.

    Move position_m within the sheet: x from x_min to x_max, along the arc within half its width; or widen the sheet.
    """
    spec = subject.descriptor.spec
    sheet = sheet_of(spec)
    if sheet is None:
        skip("it declares no skin")
    low, high, half = sheet.x_min.to("mm"), sheet.x_max.to("mm"), sheet.arc.to("mm") / 2
    for place, _, channel in _channels(spec):
        if channel.position_m is None or channel.kind != "taxel":
            continue
        x_mm, s_mm = on_sheet_mm(sheet, channel.position_m)
        if not (low - _EDGE_MM <= x_mm <= high + _EDGE_MM and abs(s_mm) <= half + _EDGE_MM):
            fail(
                f"{place}.position_m",
                f"x {x_mm:.3g} mm, along the arc {s_mm:.3g} mm is off the sheet (x {low:g} to {high:g} mm, arc "
                f"{-half:g} to {half:g} mm)",
            )


@check("sensor", may_skip=True)
def normals_are_unit(subject: Subject) -> None:
    """Forces are projected on normals; one of another length scales them in silence.

    Divide the normal by its length.
    """
    normals = [(place, one.normal) for place, _, one in _channels(subject.descriptor.spec) if one.normal is not None]
    if not normals:
        skip("it states no normals")
    for place, normal in normals:
        length = math.sqrt(sum(part**2 for part in normal))
        if not abs(length - 1.0) <= _UNIT_NORMAL:
            fail(f"{place}.normal", f"its length is {length:.4g}, not 1")


@check("sensor", may_skip=True)
def contact_point_is_on_the_sheet(subject: Subject) -> None:
    """Every scene presses at the nominal contact point, and is refused where that lies off the skin.

    Correct the parameters contact_x and contact_s, or the skin's sheet.
    """
    spec = subject.descriptor.spec
    sheet = sheet_of(spec)
    stated = [name for name in ("contact_x", "contact_s") if name in spec.parameters]
    if sheet is None or not stated:
        skip("it states no skin with a nominal contact point of its own")
    half = sheet.arc.to("mm") / 2
    ends = {"contact_x": (sheet.x_min.to("mm"), sheet.x_max.to("mm")), "contact_s": (-half, half)}
    for name in stated:
        low, high = ends[name]
        try:
            value = spec.parameters[name].to("mm")
        except UsageError:
            fail(f"spec.parameters[{name}].unit", f"{spec.parameters[name].unit!r} is no length")
        if not low <= value <= high:
            fail(f"spec.parameters[{name}]", f"{value:g} mm is not within {low:g} to {high:g} mm")


@check("sensor", may_skip=True)
def skin_is_possible(subject: Subject) -> None:
    """The twin divides by these numbers: a negative stiffness or a sheet without area ends in no solution.

    State positive lengths, stiffnesses and moduli, and Poisson's ratio between 0 and 0.5.
    """
    skin = subject.descriptor.spec.skin
    if skin is None:
        skip("it declares no skin")
    sheet = skin.sheet
    if not sheet.x_min.to("mm") < sheet.x_max.to("mm"):
        fail("spec.skin.sheet.x_max", f"{sheet.x_max} is not above x_min, {sheet.x_min}")
    if not sheet.arc.to("mm") > 0:
        fail("spec.skin.sheet.arc", f"{sheet.arc} is not above 0")
    if min(sheet.cells) < 4:
        fail("spec.skin.sheet.cells", f"{sheet.cells}: at least 4 cells either way are needed")
    for field in ("young", "shear", "thickness", "mid_radius", "contact_stiffness", "core_stiffness"):
        value = getattr(skin, field, None)
        if value is not None and not value.value > 0:
            fail(f"spec.skin.{field}", f"{value} is not above 0")
    poisson = getattr(skin, "poisson", None)
    if poisson is not None and not 0 <= poisson.to("1") <= 0.5:
        fail("spec.skin.poisson", f"{poisson} is not within 0 to 0.5")


@check("sensor", may_skip=True)
def nuisances_are_of_its_kinds(subject: Subject) -> None:
    """Noise stated for a kind that the sensor does not have is applied to nothing, in silence.

    Name the kind of channel that the sensor has; `show NAME` lists them.
    """
    spec = subject.descriptor.spec
    if not spec.nuisances:
        skip("it states no nuisances")
    present = {channel.kind for channel in spec.channels()}
    for kind in spec.nuisances:
        if kind not in present:
            fail(f"spec.nuisances[{kind}]", f"it has no {kind} channel; it has {', '.join(sorted(present))}")


@check("sensor", needs=("nuisances-are-of-its-kinds",))
def nuisances_are_in_its_units(subject: Subject) -> None:
    """Amounts are added to readings as they are: volts on a channel of counts are off by its whole scale.

    State amounts in the channel's own unit, shares in 1, time constants in a time.
    """
    spec = subject.descriptor.spec
    for kind, unit, field, amount in _amounts(spec):
        expected = {"tau": "s", "share": "1"}.get(_dimension(field), unit)
        same = units.parse(amount.unit)[1] == units.parse(expected)[1]
        # Only time constants are converted; the others are taken as they are.
        if not (same if expected == "s" else amount.unit == expected):
            fail(f"spec.nuisances[{kind}].{field}", f"its unit is {amount.unit!r}, and {expected!r} is needed")


@check("sensor", needs=("nuisances-are-of-its-kinds",))
def nuisances_are_not_negative(subject: Subject) -> None:
    """Standard deviations, steps and time constants below 0 stop a run in its midst, or mean nothing.

    State 0 or more, and a time constant above 0; only a warm-up may fall.
    """
    for kind, _, field, amount in _amounts(subject.descriptor.spec):
        if not math.isfinite(amount.value) or (amount.value < 0 and field != "warm_up"):
            fail(f"spec.nuisances[{kind}].{field}", f"{amount} is no amount")
        if _dimension(field) == "tau" and not amount.value > 0:
            fail(f"spec.nuisances[{kind}].{field}", f"{amount}: a time constant is above 0")


def _amounts(spec: SensorSpec) -> Iterator[tuple[str, str, str, Any]]:
    """Yield the kind of channel, its unit, and each amount stated for it with the field."""
    for kind, nuisances in spec.nuisances.items():
        unit = next((channel.unit for channel in spec.channels(kind)), "count")
        for field, amount in nuisances.by_name(kind).values():
            if field in nuisances.model_fields_set or field.startswith("creep_"):
                yield kind, unit, field, amount


def _dimension(field: str) -> str:
    if field.endswith("_tau"):
        return "tau"
    share = field.endswith(("_fraction", "_scatter")) or field in ("unit_gain", "offset_smooth")
    return "share" if share else "amount"


@check("sensor", may_skip=True)
def link_delay_is_a_time(subject: Subject) -> None:
    """Answer delays add it up; a delay below 0, or of a minute, is a slip.

    State link_delay as a time of 0 to 10 s, or leave it out.
    """
    delay = subject.descriptor.spec.link_delay
    if delay is None:
        skip("it states no link delay")
    try:
        seconds = delay.to("s")
    except UsageError:
        fail("spec.link_delay.unit", f"{delay.unit!r} is no time")
    if not 0 <= seconds <= 10:
        fail("spec.link_delay", f"{delay} is not within 0 to 10 s")


@check("sensor", may_skip=True)
def rates_are_possible(subject: Subject) -> None:
    """Delays, windows and clocks are computed from the stated rate; a period given for a rate is off by thousands.

    State rate_hz in samples a second, or leave it out where nobody states it.
    """
    spec = subject.descriptor.spec
    stated = [stream for stream in spec.streams if stream.rate_hz is not None]
    if not stated:
        skip("nobody states a rate of its streams")
    for stream in stated:
        if not 0.1 <= stream.rate_hz <= 1e6:
            fail(f"spec.streams[{stream.name}].rate_hz", f"{stream.rate_hz:g} Hz is not within 0.1 Hz to 1 MHz")


CHECKS = (
    hdf5_round_trip, limits_are_in_order, limits_fit_the_type, saturation_is_declared, units_are_of_the_kind,
    rates_are_possible, positions_are_complete, positions_are_in_metres, positions_are_apart,
    positions_are_on_the_sheet, normals_are_unit, contact_point_is_on_the_sheet, skin_is_possible,
    nuisances_are_of_its_kinds, nuisances_are_in_its_units, nuisances_are_not_negative, link_delay_is_a_time,
)  # fmt: skip

"""Specification of a sensor: streams, channels, positions, skin and nuisances, each with its source."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from tactbench.core.errors import NotApplicable, UsageError, complaint
from tactbench.core.spec import units
from tactbench.core.spec.quantity import Frozen, Length, Mass, Power, Quantity, Share, Source, Tag, Time, Unit, assumed
from tactbench.core.spec.skin import Skin

ChannelKind = Literal[
    "taxel", "dc_pressure", "ac_pressure", "dc_temperature", "ac_temperature",
    "force", "torque", "position", "joint", "other",
]  # fmt: skip
"""Kind of quantity that a channel measures; tasks refer to kinds, never to channels of a particular sensor."""

SENSOR_NAME = r"^[a-z][a-z0-9_-]*$"

Vector = tuple[float, float, float]


class PhysicalRange(Frozen):
    """A range of a physical quantity, as a data sheet or a paper states it."""

    lower: float
    upper: float
    unit: str
    source: Source

    def __str__(self) -> str:
        return f"{self.lower:g}–{self.upper:g} {self.unit}"


def ranges(*stated: tuple[str, float, float, str, Tag, str]) -> dict[str, PhysicalRange]:
    """Return ranges by name from tuples (name, lower, upper, unit, tag, reference)."""
    return {
        name: PhysicalRange(lower=lower, upper=upper, unit=unit, source=Source(tag=tag, reference=reference))
        for name, lower, upper, unit, tag, reference in stated
    }


class ChannelSpec(Frozen):
    """A channel of a stream, which gives one number for each sample."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")
    """Name of the channel, unique within the sensor."""
    kind: ChannelKind
    unit: Unit = "count"
    """Unit of the channel's stored numbers; `count` for the raw reading of a converter."""
    lower: float | None = None
    """Smallest value that the channel's converter can give, in `unit`."""
    upper: float | None = None
    """Largest value that the channel's converter can give, in `unit`."""
    rest: Quantity | None = None
    """Reading of the unloaded channel, in `unit`."""
    sign: Literal[-1, 0, 1] = 0
    """Sign of the response to load: +1 if the reading rises, -1 if it falls, 0 if it may do either or is unknown."""
    position_m: Vector | None = None
    """Position (x, y, z) in the sensor's frame [m]: x along the finger towards the tip, y across it, and the pressed
    pad on the side of negative z. On the skin's sheet, x is the axial coordinate; y, or the arc on a finger, is s."""
    normal: Vector | None = None
    """Outward unit normal of the surface at `position_m`."""
    site: str | None = Field(default=None, min_length=1)
    """Name of the place that several channels share, such as the axes of one magnet, with one position and normal;
    None: the channel has a place of its own."""
    position_source: Source | None = None
    """Source of the channel's position and normal."""
    scale: Quantity | None = None
    """Physical quantity for one stored unit, if the channel is linear (36.5 Pa per count)."""
    measures: PhysicalRange | None = None
    """Range of the channel in physical units."""
    band: PhysicalRange | None = None
    """Frequency band that the channel measures."""


class StreamSpec(Frozen):
    """A stream of samples from channels that share one clock."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    rate_hz: float | None = Field(default=None, gt=0)
    """Nominal sample rate of the stream [Hz]; None: no source states a rate."""
    rate_source: Source | None = None
    dtype: Literal["uint8", "uint16", "int16", "int32", "float32", "float64"] = "float64"
    """Numeric type of the stored samples."""
    channels: tuple[ChannelSpec, ...] = Field(min_length=1)


class Creep(Frozen):
    """An exponential term of the delay by which the response follows the load."""

    fraction: Share
    """Share of the response that arrives late, by this term [1]."""
    tau: Time
    """Time constant of the term [time]."""


_NO_COUNTS, _NO_SHARE = (assumed(0.0, unit, "the sensor states none") for unit in ("count", "1"))
_ANY_TIME = assumed(1.0, "s", "without effect")


class Nuisances(Frozen):
    """Noise, drift and scatter of all channels of one kind, which a simulation adds to the noise-free readings.

    Amounts are in the channel's own unit, ``count`` for raw readings. An omitted amount is 0; a warm-up or a
    wander needs its time constant.
    """

    white: Quantity = _NO_COUNTS
    """Standard deviation of the white noise before rounding."""
    offset_shared: Quantity = _NO_COUNTS
    """Standard deviation of an offset that all channels of one recording share."""
    offset_own: Quantity = _NO_COUNTS
    """Root mean square, over channels and recordings, of each channel's own offset in a recording."""
    offset_session: Quantity = _NO_COUNTS
    """Standard deviation, from session to session, of each channel's own offset."""
    gain_scatter: Quantity = _NO_SHARE
    """Standard deviation of the gain across the channels of one sensor unit [1]."""
    warm_up: Quantity = _NO_COUNTS
    """Rise of the rest level, shared by all channels, from power-on to equilibrium."""
    warm_up_tau: Time = _ANY_TIME
    """Time constant of the rise after power-on [time]."""
    warm_up_scatter: Quantity = _NO_SHARE
    """Standard deviation of each channel's factor on the rise after power-on [1]."""
    wander: Quantity = _NO_COUNTS
    """Standard deviation of the random drift (an Ornstein–Uhlenbeck process)."""
    wander_tau: Time = _ANY_TIME
    """Correlation time of the random drift [time]."""
    step: Quantity = _NO_COUNTS
    """Step between neighbouring values of the converter."""
    creep: tuple[Creep, ...] = ()
    unit_gain: Quantity | None = None
    """Standard deviation of a gain that a unit's channels share, from unit to unit [1]; None: not stated, used as 0."""
    unit_rest_shared: Quantity | None = None
    """Standard deviation of the difference of another unit's rest levels from the spec's, shared by its channels."""
    unit_rest_own: Quantity | None = None
    """Standard deviation of the difference of another unit's rest levels from the spec's, for each channel alone."""
    offset_smooth: Quantity | None = None
    """Share of the variance of own offsets that is a smooth (quadratic) function of the place [1]; None: no share."""

    @model_validator(mode="before")
    @classmethod
    def _read_earlier_form(cls, given: Any) -> Any:
        """Return nuisances of an earlier recording without a field that no longer exists."""
        if isinstance(given, dict) and "largest_slope" in given:
            return {name: value for name, value in given.items() if name != "largest_slope"}
        return given

    @model_validator(mode="after")
    def _has_its_time_constants(self) -> Nuisances:
        for name in ("warm_up", "wander"):
            if getattr(self, name).value and f"{name}_tau" not in self.model_fields_set:
                raise ValueError(f"{name} is not 0, so its time constant {name}_tau is needed")
        return self

    def by_name(self, kind: str) -> dict[str, tuple[str, Quantity]]:
        """Return every amount with its field, by the name of the amount in settings of a run: ``taxel_white_count``."""
        stated = {field: one for field, one in self if isinstance(one, Quantity)}
        for place, term in enumerate(self.creep, start=1):
            stated |= {f"creep_{place}_fraction": term.fraction, f"creep_{place}_tau": term.tau}
        return {units.with_unit(f"{kind}_{field}", one.unit): (field, one) for field, one in stated.items()}

    def with_values(self, kind: str, values: Mapping[str, float]) -> Nuisances:
        """Return these nuisances with `values` in place of their own, given by name; unknown names are ignored.

        Raises UsageError if an amount cannot have the given value.
        """
        known = self.by_name(kind)
        data = self.model_dump(exclude_unset=True)
        for name in values.keys() & known.keys():
            (field, old), value = known[name], values[name]
            if value < 0 and field != "warm_up":
                raise UsageError(f"{name} = {value:g} is below 0.", hint="Give 0 or more.")
            of, place, part = field.split("_") if field.startswith("creep_") else ("", "1", field)
            inside = data["creep"][int(place) - 1] if of else data
            inside[part] = assumed(value, old.unit, "set for this run")
        try:
            return Nuisances.model_validate(data)
        except ValidationError as error:
            hint = "Set an amount and its time constant together."
            raise UsageError(f"{kind}: {complaint(error)}.", hint=hint) from error

    def hidden(self, noise_scale: float = 1.0) -> float:
        """Return the standard deviation of white noise plus rounding, in the channel's unit."""
        return math.hypot(noise_scale * self.white.value, self.step.value / math.sqrt(12.0))


class Scenario(Frozen):
    """A scenario: nuisances for another way of handling the sensor."""

    title: str
    """Description of the handling of the sensor, in a few words."""
    nuisances: dict[ChannelKind, Nuisances] = Field(min_length=1)
    """Nuisances by kind of channel; kinds that are omitted keep the nuisances of the spec."""


class Statement(Frozen):
    """A statement from a document, in words."""

    text: str = Field(min_length=1)
    source: Source


class DataSheet(Frozen):
    """Facts about the sensor as a device, for an integrator; None: no source states the fact."""

    force_range: PhysicalRange | None = None
    """Range of normal forces that the sensor measures [force]."""
    length: Length | None = None
    """Length of the sensing part along the finger's axis [length]."""
    width: Length | None = None
    """Width of the sensor across the finger [length]."""
    height: Length | None = None
    """Height of the sensor from its mount to the touched surface [length]."""
    mass: Mass | None = None
    """Mass of the sensor without cable and mount [mass]."""
    interface: Statement | None = None
    """Electrical interface through which readings are transferred."""
    power: Power | None = None
    """Power that the sensor draws from its supply [power]."""
    availability: Statement | None = None
    """Availability of the device, for example by purchase."""
    exists: bool = True
    """True if the device exists; `tactbench choose` omits sensors that are mere definitions."""

    @model_validator(mode="after")
    def _has_its_units(self) -> DataSheet:
        if self.force_range is not None:
            units.conversion(self.force_range.unit, "N")
            if not 0 <= self.force_range.lower < self.force_range.upper:
                raise ValueError("a force range must begin at 0 N or more and end at a larger force")
        return self


class SensorSpec(Frozen):
    """Specification of a tactile sensor. ``docs/plugins.md`` has a worked example."""

    name: str = Field(pattern=SENSOR_NAME)
    title: str
    principle: str
    """Principle by which a taxel measures: resistive, capacitive, magnetic …"""
    principle_source: Source
    streams: tuple[StreamSpec, ...] = Field(min_length=1)
    link_delay: Time | None = None
    """Time from taking a sample to its arrival at the host, with frame and bus [time]; None: no source states it."""
    skin: Skin | None = None
    """Skin of the sensor for simulation; None: the sensor can only be recorded or replayed."""
    reads_shear: tuple[ChannelKind, ...] = ()
    """Kinds of channels whose transducer reads `tangential_displacement_mm` and `shear_mpa` of a SkinState, which are
    computed for these kinds only."""
    parameters: dict[str, Quantity] = Field(default_factory=dict)
    """Parameters with which the sensor's own transducer computes readings."""
    nuisances: dict[ChannelKind, Nuisances] = Field(default_factory=dict)
    """Noise, drift and scatter for simulation, by kind of channel."""
    scenarios: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$")], Scenario] = Field(default_factory=dict)
    """Scenarios by name: ways of handling the sensor that the usual nuisances do not cover; a scene selects one."""
    ranges: dict[str, PhysicalRange] = Field(default_factory=dict, exclude=True)
    """Ranges of nuisances, and of a scene's factors on nuisances, by their names in settings of a run. Recordings and
    keys omit these ranges, as no sample depends on them."""
    references: tuple[str, ...] = ()
    data_sheet: DataSheet = Field(default=DataSheet(), exclude=True)
    """Facts about the device. Recordings and keys omit them, as no sample depends on them."""

    @model_validator(mode="after")
    def _names_and_places_agree(self) -> SensorSpec:
        for what, several in (("channel", self.channels()), ("stream", self.streams)):
            names = [one.name for one in several]
            if doubled := sorted({name for name in names if names.count(name) > 1}):
                raise ValueError(f"{what} names must be unique in a sensor; these are repeated: {', '.join(doubled)}")
        for first, *others in self.sites():
            for one in others:
                if (one.position_m, one.normal) != (first.position_m, first.normal):
                    raise ValueError(f"site {one.site}: {one.name} and {first.name} must state the same place")
        return self

    def channels(self, *kinds: ChannelKind) -> tuple[ChannelSpec, ...]:
        """Return the channels of the given kinds, or without arguments all channels, in the order of the streams."""
        every = (channel for stream in self.streams for channel in stream.channels)
        return tuple(channel for channel in every if not kinds or channel.kind in kinds)

    def sites(self, *kinds: ChannelKind) -> tuple[tuple[ChannelSpec, ...], ...]:
        """Return the channels of the given kinds in groups of one place: a site's channels, or one other channel."""
        found: dict[tuple[str | None, str], list[ChannelSpec]] = {}
        for one in self.channels(*kinds):
            found.setdefault((one.site, "" if one.site else one.name), []).append(one)
        return tuple(map(tuple, found.values()))

    def settable(self) -> dict[str, Quantity]:
        """Return the amounts of all nuisances of the sensor, by their names in settings of a run."""
        return {name: amount for kind, own in self.nuisances.items() for name, (_, amount) in own.by_name(kind).items()}

    def with_nuisances(self, values: Mapping[str, float]) -> SensorSpec:
        """Return the spec with `values` in place of its own nuisances, given by name; unknown names are ignored.

        Raises UsageError if a nuisance cannot have the given value.
        """
        if not values.keys() & self.settable().keys():
            return self
        nuisances = {kind: own.with_values(kind, values) for kind, own in self.nuisances.items()}
        return self.model_copy(update={"nuisances": nuisances})

    def handled(self, scenario: str | None) -> SensorSpec:
        """Return the spec with a scenario's nuisances (None: the usual ones); raise NotApplicable if it is unknown."""
        if scenario is None:
            return self
        if scenario not in self.scenarios:
            raise NotApplicable(
                f"{self.name} states no scenario {scenario!r}; known scenarios: {', '.join(self.scenarios) or 'none'}.",
                hint="Leave the scenario out, or add it to the sensor's spec.",
            )
        return self.model_copy(update={"nuisances": {**self.nuisances, **self.scenarios[scenario].nuisances}})

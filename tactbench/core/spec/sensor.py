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
"""Kind of quantity that a channel measures; tasks name kinds, never channels of a sensor."""

SENSOR_NAME = r"^[a-z][a-z0-9_-]*$"

Vector = tuple[float, float, float]


class PhysicalRange(Frozen):
    """A range in physical units, as a data sheet or a paper states it."""

    lower: float
    upper: float
    unit: str
    source: Source

    def __str__(self) -> str:
        return f"{self.lower:g}–{self.upper:g} {self.unit}"


def ranges(*stated: tuple[str, float, float, str, Tag, str]) -> dict[str, PhysicalRange]:
    """Return ranges by name, made of tuples (name, lower, upper, unit, tag, reference)."""
    return {
        name: PhysicalRange(lower=lower, upper=upper, unit=unit, source=Source(tag=tag, reference=reference))
        for name, lower, upper, unit, tag, reference in stated
    }


class ChannelSpec(Frozen):
    """A channel, which gives one number per sample."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")
    """Name, unique within the sensor."""
    kind: ChannelKind
    unit: Unit = "count"
    """Unit of the stored numbers; `count` for a raw converter reading."""
    lower: float | None = None
    """Smallest value that the converter gives."""
    upper: float | None = None
    """Largest value that the converter gives."""
    rest: Quantity | None = None
    """Reading without a touch, in `unit`."""
    sign: Literal[-1, 0, 1] = 0
    """Sign of the response: +1 if the reading rises under load, -1 if it falls, 0 if it does either or is not known."""
    position_m: Vector | None = None
    """Place (x, y, z) in the sensor's frame [m]: x along the finger towards the tip, y across, -z to the pad that is
    pressed. On the skin's sheet, x is the axial coordinate and y, or on a finger its arc, is s."""
    normal: Vector | None = None
    """Outward unit normal at that place."""
    site: str | None = Field(default=None, min_length=1)
    """Name of the place of several channels, as the axes of one magnet, which state one position and normal; None: the
    channel has a place of its own."""
    position_source: Source | None = None
    """Source of position and normal."""
    scale: Quantity | None = None
    """Physical units for each stored unit, of a linear channel (36.5 Pa per count)."""
    measures: PhysicalRange | None = None
    """Range in physical units."""
    band: PhysicalRange | None = None
    """Frequency band."""


class StreamSpec(Frozen):
    """A stream: channels that share one clock."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    rate_hz: float | None = Field(default=None, gt=0)
    """Nominal sample rate [Hz]; None: no source states one."""
    rate_source: Source | None = None
    dtype: Literal["uint8", "uint16", "int16", "int32", "float32", "float64"] = "float64"
    """Type of the stored samples."""
    channels: tuple[ChannelSpec, ...] = Field(min_length=1)


class Creep(Frozen):
    """An exponential term of the lag of the response behind the load."""

    fraction: Share
    """Share of the response that arrives late [1]."""
    tau: Time
    """Its time constant [time]."""


_NO_COUNTS, _NO_SHARE = (assumed(0.0, unit, "the sensor states none") for unit in ("count", "1"))
_ANY_TIME = assumed(1.0, "s", "without effect")


class Nuisances(Frozen):
    """Noise, drift and scatter of all channels of one kind, which a simulation adds to the physics.

    Amounts are in the channel's own unit, ``count`` for raw readings. An amount that is left out is 0; a warm-up or a
    wander needs its time constant.
    """

    white: Quantity = _NO_COUNTS
    """Standard deviation of white noise, before rounding."""
    offset_shared: Quantity = _NO_COUNTS
    """Standard deviation of an offset that all channels of one recording share."""
    offset_own: Quantity = _NO_COUNTS
    """Root mean square, over channels and recordings, of each channel's own offset in a recording."""
    offset_session: Quantity = _NO_COUNTS
    """Standard deviation of each channel's own offset between sessions."""
    gain_scatter: Quantity = _NO_SHARE
    """Standard deviation of each channel's gain within one sensor unit [1]."""
    warm_up: Quantity = _NO_COUNTS
    """Rise of the shared rest level from power-on to equilibrium."""
    warm_up_tau: Time = _ANY_TIME
    """Time constant of that rise [time]."""
    warm_up_scatter: Quantity = _NO_SHARE
    """Standard deviation of the factors with which channels follow it [1]."""
    wander: Quantity = _NO_COUNTS
    """Standard deviation of free drift (Ornstein–Uhlenbeck)."""
    wander_tau: Time = _ANY_TIME
    """Its correlation time [time]."""
    step: Quantity = _NO_COUNTS
    """Step of the converter."""
    creep: tuple[Creep, ...] = ()
    unit_gain: Quantity | None = None
    """Standard deviation of a gain that all channels of a unit share, from unit to unit [1]; None: not stated, 0."""
    unit_rest_shared: Quantity | None = None
    """Standard deviation by which the rest level of all channels of another unit differs from the spec's."""
    unit_rest_own: Quantity | None = None
    """Standard deviation by which the rest level of each channel of another unit differs by itself."""
    offset_smooth: Quantity | None = None
    """Share of the variance of own offsets that is a quadratic function of the channels' places [1]; None: none is."""

    @model_validator(mode="before")
    @classmethod
    def _read_earlier_form(cls, given: Any) -> Any:
        """Return nuisances of an earlier recording without a field that was given up."""
        if isinstance(given, dict) and "largest_slope" in given:
            return {name: value for name, value in given.items() if name != "largest_slope"}
        return given

    @model_validator(mode="after")
    def _has_its_time_constants(self) -> Nuisances:
        for name in ("warm_up", "wander"):
            if getattr(self, name).value and f"{name}_tau" not in self.model_fields_set:
                raise ValueError(f"{name} is not 0, so {name}_tau is needed")
        return self

    def by_name(self, kind: str) -> dict[str, tuple[str, Quantity]]:
        """Return every amount with its field, by its name in settings of a run: ``taxel_white_count``."""
        stated = {field: one for field, one in self if isinstance(one, Quantity)}
        for place, term in enumerate(self.creep, start=1):
            stated |= {f"creep_{place}_fraction": term.fraction, f"creep_{place}_tau": term.tau}
        return {units.with_unit(f"{kind}_{field}", one.unit): (field, one) for field, one in stated.items()}

    def with_values(self, kind: str, values: Mapping[str, float]) -> Nuisances:
        """Return these nuisances with other `values`, by name; other names are ignored.

        Raises UsageError if an amount cannot have its value.
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
            raise UsageError(f"{kind}: {complaint(error)}.", hint="Set that as well.") from error

    def hidden(self, noise_scale: float = 1.0) -> float:
        """Return the standard deviation of white noise and rounding together, in the channel's unit."""
        return math.hypot(noise_scale * self.white.value, self.step.value / math.sqrt(12.0))


class Scenario(Frozen):
    """Nuisances of another way of handling the sensor, which has a name."""

    title: str
    """Description of the handling, in a few words."""
    nuisances: dict[ChannelKind, Nuisances] = Field(min_length=1)
    """Nuisances by kind of channel; kinds that are left out keep those of the spec."""


class Statement(Frozen):
    """A statement of a document in words."""

    text: str = Field(min_length=1)
    source: Source


class DataSheet(Frozen):
    """Facts for an integrator about the sensor as a device; None: no source states the fact."""

    force_range: PhysicalRange | None = None
    """Normal forces that it measures [force]."""
    length: Length | None = None
    """Length of the sensing part along the finger [length]."""
    width: Length | None = None
    """Width across the finger [length]."""
    height: Length | None = None
    """Height from the mount to the touched surface [length]."""
    mass: Mass | None = None
    """Mass without cable and mount [mass]."""
    interface: Statement | None = None
    """Electrical interface of the readings."""
    power: Power | None = None
    """Power that it draws from its supply [power]."""
    availability: Statement | None = None
    """Availability of the device."""
    exists: bool = True
    """Whether there is such a device; `tactbench choose` leaves out mere definitions."""

    @model_validator(mode="after")
    def _has_its_units(self) -> DataSheet:
        if self.force_range is not None:
            units.conversion(self.force_range.unit, "N")
            if not 0 <= self.force_range.lower < self.force_range.upper:
                raise ValueError("a force range goes from 0 or more up to a larger force")
        return self


class SensorSpec(Frozen):
    """A tactile sensor. See ``docs/plugins.md`` for a worked example."""

    name: str = Field(pattern=SENSOR_NAME)
    title: str
    principle: str
    """Principle by which a taxel measures: resistive, capacitive, magnetic …"""
    principle_source: Source
    streams: tuple[StreamSpec, ...] = Field(min_length=1)
    link_delay: Time | None = None
    """Time from taking a sample to having it in the host, through frame and bus [time]; None: no source states it."""
    skin: Skin | None = None
    """Skin for simulation; None: the sensor can only be recorded or replayed."""
    reads_shear: tuple[ChannelKind, ...] = ()
    """Kinds of channels whose transducer uses `tangential_displacement_mm` and `shear_mpa` of a SkinState, which are
    not computed otherwise."""
    parameters: dict[str, Quantity] = Field(default_factory=dict)
    """Parameters of the sensor's own transduction."""
    nuisances: dict[ChannelKind, Nuisances] = Field(default_factory=dict)
    """Nuisances for simulation, by kind of channel."""
    scenarios: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$")], Scenario] = Field(default_factory=dict)
    """Ways of handling that the usual nuisances do not cover, by name; a scene's simulation selects one."""
    ranges: dict[str, PhysicalRange] = Field(default_factory=dict, exclude=True)
    """Ranges of nuisances, and of a scene's factors on them, by their names in settings of a run. They are left out of
    recordings and keys, as no sample depends on them."""
    references: tuple[str, ...] = ()
    data_sheet: DataSheet = Field(default=DataSheet(), exclude=True)
    """Facts about the device. They are left out of recordings and keys, as no sample depends on them."""

    @model_validator(mode="after")
    def _names_and_places_agree(self) -> SensorSpec:
        for what, several in (("channel", self.channels()), ("stream", self.streams)):
            names = [one.name for one in several]
            if doubled := sorted({name for name in names if names.count(name) > 1}):
                raise ValueError(f"{what} names must be unique in a sensor; repeated: {', '.join(doubled)}")
        for first, *others in self.sites():
            for one in others:
                if (one.position_m, one.normal) != (first.position_m, first.normal):
                    raise ValueError(f"site {one.site}: {one.name} and {first.name} state different places")
        return self

    def channels(self, *kinds: ChannelKind) -> tuple[ChannelSpec, ...]:
        """Return the channels of the given kinds, or all of them without arguments, in the order of the streams."""
        every = (channel for stream in self.streams for channel in stream.channels)
        return tuple(channel for channel in every if not kinds or channel.kind in kinds)

    def sites(self, *kinds: ChannelKind) -> tuple[tuple[ChannelSpec, ...], ...]:
        """Return the channels of the given kinds by place: those of a site together, every other one separately."""
        found: dict[tuple[str | None, str], list[ChannelSpec]] = {}
        for one in self.channels(*kinds):
            found.setdefault((one.site, "" if one.site else one.name), []).append(one)
        return tuple(map(tuple, found.values()))

    def settable(self) -> dict[str, Quantity]:
        """Return the amounts of the sensor's nuisances, by their names in settings of a run."""
        return {name: amount for kind, own in self.nuisances.items() for name, (_, amount) in own.by_name(kind).items()}

    def with_nuisances(self, values: Mapping[str, float]) -> SensorSpec:
        """Return the spec with other `values` of its nuisances, by name; other names are ignored.

        Raises UsageError if a nuisance cannot have its value.
        """
        if not values.keys() & self.settable().keys():
            return self
        nuisances = {kind: own.with_values(kind, values) for kind, own in self.nuisances.items()}
        return self.model_copy(update={"nuisances": nuisances})

    def handled(self, scenario: str | None) -> SensorSpec:
        """Return the spec with the nuisances of a scenario (None: the usual ones); raises NotApplicable if unknown."""
        if scenario is None:
            return self
        if scenario not in self.scenarios:
            raise NotApplicable(
                f"{self.name} states no scenario {scenario!r}; it states {', '.join(self.scenarios) or 'none'}.",
                hint="Leave the scenario out, or state it in the sensor's spec.",
            )
        return self.model_copy(update={"nuisances": {**self.nuisances, **self.scenarios[scenario].nuisances}})

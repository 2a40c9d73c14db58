"""What a sensor is: streams, channels, where they sit, what they are made of, and who says so."""

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
"""What a channel measures. Tasks ask for kinds, never for a sensor's own names."""

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
    """Return ranges by name, of (name, lower, upper, unit, tag, reference) each."""
    return {
        name: PhysicalRange(lower=lower, upper=upper, unit=unit, source=Source(tag=tag, reference=reference))
        for name, lower, upper, unit, tag, reference in stated
    }


class ChannelSpec(Frozen):
    """One number per sample."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")
    """Unique within the sensor."""
    kind: ChannelKind
    unit: Unit = "count"
    """Unit of the stored numbers; `count` for a raw converter reading."""
    lower: float | None = None
    """Smallest value the converter can give."""
    upper: float | None = None
    """Largest value the converter can give."""
    rest: Quantity | None = None
    """Reading with nothing touching, in `unit`."""
    sign: Literal[-1, 0, 1] = 0
    """+1: the reading rises under load; -1: it falls; 0: either, or not known."""
    position_m: Vector | None = None
    """Place (x, y, z) on the sensor [m], in the sensor's frame: x along the finger towards the tip, y across, -z to the
    pad that is pressed. On the skin's sheet, x is the axial coordinate and y, or on a finger its arc, is s."""
    normal: Vector | None = None
    """Outward unit normal at that place."""
    site: str | None = Field(default=None, min_length=1)
    """Name of the place, where several channels read it (the axes of one magnet): they state one position and normal.
    None: the channel has a place of its own."""
    position_source: Source | None = None
    """Who states position and normal."""
    scale: Quantity | None = None
    """Physical units per stored unit, if it is linear (36.5 Pa per count)."""
    measures: PhysicalRange | None = None
    """Physical range."""
    band: PhysicalRange | None = None
    """Frequency band."""


class StreamSpec(Frozen):
    """Channels that share one clock."""

    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")
    rate_hz: float | None = Field(default=None, gt=0)
    """Nominal sample rate; None when nobody states one (never invented)."""
    rate_source: Source | None = None
    dtype: Literal["uint8", "uint16", "int16", "int32", "float32", "float64"] = "float64"
    """How samples are stored."""
    channels: tuple[ChannelSpec, ...] = Field(min_length=1)


class Creep(Frozen):
    """One exponential term by which the response lags behind the load."""

    fraction: Share
    """Share of the response that arrives late [1]."""
    tau: Time
    """Its time constant [time]."""


_NONE_STATED = "the sensor states none"
_NO_COUNTS = assumed(0.0, "count", _NONE_STATED)
_NO_SHARE = assumed(0.0, "1", _NONE_STATED)
_ANY_TIME = assumed(1.0, "s", "without effect")


class Nuisances(Frozen):
    """What comes on top of the physics, for all channels of one kind.

    Amounts are in the channel's own unit, ``count`` for raw readings, and added to readings as they are. Shares are in
    1, time constants in a time.

    What is left out is 0; a warm-up or a wander needs its time constant.
    """

    white: Quantity = _NO_COUNTS
    """Standard deviation of white noise, before rounding."""
    offset_shared: Quantity = _NO_COUNTS
    """Standard deviation of an offset that all channels of one recording share."""
    offset_own: Quantity = _NO_COUNTS
    """Each channel's own offset in a recording: its root mean square over channels and recordings."""
    offset_session: Quantity = _NO_COUNTS
    """Standard deviation of each channel's own offset between sessions."""
    gain_scatter: Quantity = _NO_SHARE
    """Standard deviation of each channel's gain within one sensor unit [1]."""
    warm_up: Quantity = _NO_COUNTS
    """How far the shared rest level rises from power-on to equilibrium."""
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
    """The same for each channel's own."""
    offset_smooth: Quantity | None = None
    """Share of the own offsets' variance that is a quadratic of the channels' places [1]; None: all of it is each
    channel's by itself."""

    @model_validator(mode="before")
    @classmethod
    def _without_largest_slope(cls, given: Any) -> Any:
        """Pass over a field of recordings written before slopes came from the scene's own load table."""
        if isinstance(given, dict) and "largest_slope" in given:
            return {name: value for name, value in given.items() if name != "largest_slope"}
        return given

    @model_validator(mode="after")
    def _has_its_time_constants(self) -> Nuisances:
        for name in ("warm_up", "wander"):
            if getattr(self, name).value and f"{name}_tau" not in self.model_fields_set:
                raise ValueError(f"{name} is not 0, so {name}_tau is needed, the time constant of it")
        return self

    def by_name(self, kind: str) -> dict[str, tuple[str, Quantity]]:
        """Return every amount with its field, by the name under which a run sets it: ``taxel_white_count``."""
        stated = {field: getattr(self, field) for field in type(self).model_fields if field != "creep"}
        for place, term in enumerate(self.creep, start=1):
            stated |= {f"creep_{place}_fraction": term.fraction, f"creep_{place}_tau": term.tau}
        return {
            units.with_unit(f"{kind}_{field}", one.unit): (field, one)
            for field, one in stated.items()
            if one is not None
        }

    def with_values(self, kind: str, values: Mapping[str, float]) -> Nuisances:
        """Return these nuisances with other `values`, by name; names that are not theirs are passed over.

        Raises
        ------
        UsageError
            If an amount cannot have its value.
        """
        known = self.by_name(kind)
        given = {field: getattr(self, field) for field in self.model_fields_set}
        creep = [term.model_dump() for term in self.creep]
        for name, value in values.items():
            if name not in known:
                continue
            field, old = known[name]
            if value < 0 and field != "warm_up":
                raise UsageError(f"{name} = {value:g} is below 0.", hint="Give 0 or more.")
            new = assumed(value, old.unit, "set for this run")
            if field.startswith("creep_"):
                _, place, part = field.split("_")
                creep[int(place) - 1][part] = new
            else:
                given[field] = new
        try:
            return Nuisances.model_validate({**given, "creep": creep})
        except ValidationError as error:
            raise UsageError(f"{kind}: {complaint(error)}.", hint="Set that as well.") from error

    def hidden(self, noise_scale: float = 1.0) -> float:
        """Return the standard deviation that white noise and rounding hide anyway, in the channel's unit."""
        return math.hypot(noise_scale * self.white.value, self.step.value / math.sqrt(12.0))


class Scenario(Frozen):
    """Other nuisances than the usual ones, for a way of handling the sensor that has a name."""

    title: str
    """What is done to the sensor, in a few words."""
    nuisances: dict[ChannelKind, Nuisances] = Field(min_length=1)
    """By kind of channel, in place of the spec's own; kinds that are not here keep theirs."""


class Statement(Frozen):
    """What a document says in words."""

    text: str = Field(min_length=1)
    source: Source


class DataSheet(Frozen):
    """What an integrator asks of a sensor as a device. What no source states stays None: unknown, never guessed."""

    force_range: PhysicalRange | None = None
    """Normal forces it answers to [force]."""
    length: Length | None = None
    """Of the sensing part, along the finger [length]."""
    width: Length | None = None
    """Across the finger [length]."""
    height: Length | None = None
    """From the mount to the touched surface [length]."""
    mass: Mass | None = None
    """Without cable and mount [mass]."""
    interface: Statement | None = None
    """How readings leave it."""
    power: Power | None = None
    """Drawn from its supply [power]."""
    availability: Statement | None = None
    """Whether and where it can be had."""
    exists: bool = True
    """False: a definition, no device; `tactbench choose` leaves it out."""

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
    """How a taxel measures: resistive, capacitive, magnetic …"""
    principle_source: Source
    streams: tuple[StreamSpec, ...] = Field(min_length=1)
    link_delay: Time | None = None
    """From a sample taken to the sample in the host: frame and bus [time]. None: nobody states it."""
    skin: Skin | None = None
    """None: the sensor cannot be simulated, only recorded or replayed."""
    reads_shear: tuple[ChannelKind, ...] = ()
    """Kinds of channels whose transducer looks at `tangential_displacement_mm` and `shear_mpa` of a SkinState: the twin
    computes both only where such a channel is observed."""
    parameters: dict[str, Quantity] = Field(default_factory=dict)
    """What the sensor's own transduction needs."""
    nuisances: dict[ChannelKind, Nuisances] = Field(default_factory=dict)
    """Noise and drift by kind of channel, for the twin."""
    scenarios: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$")], Scenario] = Field(default_factory=dict)
    """Ways of handling the sensor that its usual nuisances do not cover, by name; used where a scene's simulation asks
    for one."""
    ranges: dict[str, PhysicalRange] = Field(default_factory=dict, exclude=True)
    """Between what ends nuisances may lie, by the name under which a run sets them: its own, and those of a scene that
    scale them. Left out of recordings and keys: no sample depends on it."""
    references: tuple[str, ...] = ()
    data_sheet: DataSheet = Field(default=DataSheet(), exclude=True)
    """Size, range, interface … of the device. Left out of recordings and keys: no sample depends on it."""

    @model_validator(mode="after")
    def _names_are_unique(self) -> SensorSpec:
        for what, several in (("channel", self.channels()), ("stream", self.streams)):
            names = [one.name for one in several]
            doubled = sorted({name for name in names if names.count(name) > 1})
            if doubled:
                raise ValueError(f"{what} names must be unique in a sensor; repeated: {', '.join(doubled)}")
        return self

    @model_validator(mode="after")
    def _a_site_is_one_place(self) -> SensorSpec:
        for first, *others in self.sites():
            for one in others:
                if (one.position_m, one.normal) != (first.position_m, first.normal):
                    raise ValueError(
                        f"site {one.site}: the place of {one.name} is not that of {first.name}; a site is one place"
                    )
        return self

    def channels(self, *kinds: ChannelKind) -> tuple[ChannelSpec, ...]:
        """Return the channels of the given kinds (all of them without arguments), in order of the streams."""
        every = (channel for stream in self.streams for channel in stream.channels)
        return tuple(channel for channel in every if not kinds or channel.kind in kinds)

    def sites(self, *kinds: ChannelKind) -> tuple[tuple[ChannelSpec, ...], ...]:
        """Return the channels of the given kinds by place: those of a site together, any other alone."""
        found: dict[tuple[str, str], list[ChannelSpec]] = {}
        for channel in self.channels(*kinds):
            found.setdefault(("channel", channel.name) if channel.site is None else ("site", channel.site), []).append(
                channel
            )
        return tuple(map(tuple, found.values()))

    def settable(self) -> dict[str, Quantity]:
        """Return what the sensor declares of nuisances, by the name under which a run sets it."""
        return {name: amount for kind, own in self.nuisances.items() for name, (_, amount) in own.by_name(kind).items()}

    def with_nuisances(self, values: Mapping[str, float]) -> SensorSpec:
        """Return the spec with other `values` of its nuisances, by name; names that are not its own are passed over.

        Raises
        ------
        UsageError
            If a nuisance cannot have its value.
        """
        if not values.keys() & self.settable().keys():
            return self
        nuisances = {kind: own.with_values(kind, values) for kind, own in self.nuisances.items()}
        return self.model_copy(update={"nuisances": nuisances})

    def handled(self, scenario: str | None) -> SensorSpec:
        """Return the spec with the nuisances of one of its scenarios; None: as it is.

        Raises
        ------
        NotApplicable
            If the sensor states no scenario of that name.
        """
        if scenario is None:
            return self
        if scenario not in self.scenarios:
            raise NotApplicable(
                f"{self.name} states no scenario {scenario!r}; it states {', '.join(self.scenarios) or 'none'}.",
                hint="Leave the scenario out, or state it in the sensor's spec.",
            )
        return self.model_copy(update={"nuisances": {**self.nuisances, **self.scenarios[scenario].nuisances}})

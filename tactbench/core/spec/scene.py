"""What is present and commanded while one recording is made."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    field_serializer,
    model_serializer,
    model_validator,
)

from tactbench.core.errors import UsageError, complaint
from tactbench.core.spec import units
from tactbench.core.spec.drive import ForceLoop
from tactbench.core.spec.profile import PAPER, ForceProfile, ForceRamp
from tactbench.core.spec.quantity import Frozen, Quantity, assumed, measured, sourced
from tactbench.core.spec.sensor import ChannelKind, ranges

M = TypeVar("M", bound=BaseModel)

Role = Literal["train", "validation", "test"]
"""What a recording is for, given by its task."""


class Indenter(Frozen):
    """The body pressed on the sensor: flat, a spherical cap, or of a shape that a plugin defines."""

    radius: Quantity | None = None
    """Radius of the cap [length]; None is a flat surface, or another shape."""
    shape: str | None = None
    """Name of an installed shape (``tactbench list indenters``); None: a cap if there is a radius, or else flat.
    ``cap`` and ``flat`` may be written, and are read as these."""
    dimensions: dict[str, Quantity] = Field(default_factory=dict)
    """Of the shape, by name; one that is left out has the default of the shape."""
    angle: Quantity = assumed(0.0, "deg", "the shape's own axes are those of the sensor")
    """By how much the shape is turned about the press axis, from x towards s [angle]."""

    @model_validator(mode="before")
    @classmethod
    def _cap_and_flat(cls, given: Any) -> Any:
        """Read the shapes cap and flat as the radius that says the same, so that there is one way to store them."""
        if not isinstance(given, Mapping) or given.get("shape") not in ("cap", "flat"):
            return given
        own, dimensions = dict(given), dict(given.get("dimensions") or {})
        if own.pop("shape") == "cap":
            own.setdefault("radius", dimensions.pop("radius", None))
            if own["radius"] is None:
                raise ValueError("dimensions: a cap is given by its radius, and none is given")
        return {**own, "dimensions": dimensions}

    @model_validator(mode="after")
    def _is_one_body(self) -> Indenter:
        if self.shape is not None and self.radius is not None:
            raise ValueError(f"radius: it is that of a cap; give the dimensions of {self.shape!r} under dimensions")
        if self.shape is None and self.dimensions:
            body = "a flat surface" if self.radius is None else "a cap"
            raise ValueError(f"dimensions: {body} has none of {', '.join(self.dimensions)}; name a shape")
        if self.angle.to("rad") and self.shape is None:
            raise ValueError(f"angle: {self.angle} is given; a cap and a flat surface are the same from all sides")
        return self

    @model_serializer(mode="wrap")
    def _as_ever(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what a cap and a flat surface do not need: they are stored as they were before shapes."""
        stored: dict[str, Any] = serialize(self)
        return stored if self.shape is not None else {"radius": stored["radius"]}

    def __str__(self) -> str:
        if self.shape is None:
            return f"cap R {self.radius}" if self.radius else "flat"
        sizes = ", ".join(f"{name} {size}" for name, size in self.dimensions.items())
        turned = f"turned by {self.angle}" if self.angle.value else ""
        return ", ".join(filter(None, (f"{self.shape} {sizes}".strip(), turned)))


class Placement(Frozen):
    """Where the indenter meets the sensor, relative to the sensor's own nominal contact point."""

    x: Quantity = assumed(0.0, "mm", "nominal contact point of the mount")
    """Axial offset [length]."""
    s: Quantity = assumed(0.0, "mm", "nominal contact point of the mount")
    """Offset along the arc [length]."""
    scatter: Quantity = assumed(
        0.1, "mm", "repeatability of exchanging a cap; no source states it: docs/calibration.md draws it from a prior"
    )
    """Standard deviation of both offsets from recording to recording [length]."""
    tilt_x: Quantity = assumed(0.0, "rad", "the indenter's axis is the press axis")
    """Slope of the indenter along the finger [angle]; positive: it stands further off towards the tip."""
    tilt_s: Quantity = assumed(0.0, "rad", "the indenter's axis is the press axis")
    """Slope of the indenter across the finger [angle]."""
    tilt_scatter: Quantity = assumed(
        0.0, "deg", "no source states how an exchanged cap tilts; `RANGES` has what may be"
    )
    """Standard deviation of both slopes from recording to recording [angle]."""


class Environment(Frozen):
    """What surrounds the contact, and how far the assumed nuisances are scaled."""

    since_power_on: Quantity = assumed(
        3600.0, "s", "an hour: warm; the paper does not say: docs/calibration.md draws it from a prior"
    )
    """Time from switching the sensor on to the first sample of the session [time]."""
    noise_scale: float = Field(default=1.0, ge=0)
    """Factor on white noise of the sensor; docs/calibration.md says which factors the paper's figures allow."""
    drift_scale: float = Field(default=1.0, ge=0)
    """Factor on wander and warm-up, and on offsets unless they have their own."""
    offset_scale: float | None = Field(default=None, ge=0)
    """Factor on the offsets between recordings of a session; None: that of drift."""
    session_offset_scale: float = Field(default=0.0, ge=0)
    """Factor on the offsets between sessions; 0: the sessions follow each other on one warm set-up, as in the paper."""
    force_noise: Quantity = sourced(
        0.6875, "N", f"{PAPER}: RMSE of the regression on the time index, read as label noise"
    )
    """Standard deviation of the unfiltered force-torque sensor [force]."""
    force_filter: Quantity | None = None
    """Cut-off of a low-pass on the recorded force [1/time]; None: recorded unfiltered, as in the paper."""
    ambient: Quantity = assumed(23.0, "degC", "a laboratory; the paper does not say")
    """Temperature of the room [degC]."""
    indenter_temperature: Quantity | None = None
    """Temperature of the indenter [degC]; None: as warm as what it touches, so that no heat flows. Nobody states it:
    a cap that lies in the room has that of the room."""

    @property
    def scale_of_offsets(self) -> float:
        """The factor on the offsets between recordings [1]."""
        return self.drift_scale if self.offset_scale is None else self.offset_scale


class Surface(Frozen):
    """What slides over the skin: how it holds and how rough it is."""

    static_friction: Quantity = sourced(
        0.7834, "1", "NVlabs/biotac_sim, sim_biotac.py: default coefficient for a BioTac, read as the static one"
    )
    """Largest tangential over normal force before everything slips [1]."""
    kinetic_friction: Quantity = assumed(0.65, "1", "a sixth below the static coefficient; no source for this skin")
    """The same ratio at speeds far above `stribeck_speed` [1]."""
    stribeck_speed: Quantity = assumed(5.0, "mm/s", "no source for this skin")
    """Speed over which friction falls from static to kinetic [speed]; 0: at once (Coulomb's two coefficients)."""
    roughness: Quantity = measured(
        73.0,
        "um",
        "set so that PAC holds 110 counts (rms) between 2 and 30 Hz, the median of dexrob/BioTac_slide_20_50, in one "
        "simulated slide: cap R 20 mm, 0.5 N, 50 mm/s, all three assumed",
    )
    """Root mean square of the profile [length]."""
    roll_off: Quantity = assumed(
        1.0, "mm", "some tenths of a millimetre and more, by surface: Persson et al. 2005; none known of what slides"
    )
    """Wavelength below which the profile is self-affine, and above which its spectrum is even [length]."""
    hurst: Quantity = assumed(
        0.8, "1", "0.7 to 0.9 for most surfaces; Persson et al. 2005, J. Phys.: Condens. Matter 17 R1, as recalled"
    )
    """Hurst exponent H of the profile [1]: its spectrum falls as k^-(1 + 2 H)."""

    @model_validator(mode="before")
    @classmethod
    def _of_one_band(cls, given: Any) -> Any:
        """Read the surface of an earlier recording, a band about one wavelength, by that wavelength."""
        if isinstance(given, Mapping) and "wavelength" in given:
            left = {name: value for name, value in given.items() if name != "spread"}
            return {"roll_off": left.pop("wavelength"), **left}
        return given

    @model_validator(mode="after")
    def _is_possible(self) -> Surface:
        static, kinetic = self.static_friction.to("1"), self.kinetic_friction.to("1")
        if not static >= kinetic >= 0:
            raise ValueError(f"friction must be static >= kinetic >= 0, not {static:g} and {kinetic:g}")
        if self.stribeck_speed.to("mm/s") < 0 or self.roughness.to("mm") < 0:
            raise ValueError("a Stribeck speed and a roughness are at least 0")
        if not (self.roll_off.to("mm") > 0 and 0 < self.hurst.to("1") <= 1):
            raise ValueError("a roll-off is above 0, a Hurst exponent above 0 and at most 1")
        return self


class Slide(Frozen):
    """Tangential motion of the indenter at a constant speed, at rest before and after."""

    speed: Quantity
    """Of the indenter against the sensor's core [speed]; above zero."""
    direction: Quantity = assumed(0.0, "deg", "along the finger, towards the tip")
    """Where the indenter moves to [angle]: 0 is along x, 90 deg along s."""
    start: Quantity = assumed(30.0, "s", "the middle of a recording of the paper's length")
    """Beginning of the motion, since the recording's first sample [time]."""
    duration: Quantity | None = None
    """How long it lasts [time]; None: to the end of the recording."""
    surface: Surface = Surface()

    @model_validator(mode="after")
    def _moves(self) -> Slide:
        if not self.speed.to("mm/s") > 0 or self.start.to("s") < 0:
            raise ValueError("a slide has a speed above 0 and starts at 0 s or later; leave it out for none")
        if self.duration is not None and not self.duration.to("s") > 0:
            raise ValueError("a slide lasts longer than 0 s; leave the duration out for the rest of the recording")
        self.direction.to("rad")
        return self

    def __str__(self) -> str:
        return f"{self.speed} from {self.start} on"


def _pairs(given: Any) -> Any:
    """Read a mapping as its sorted pairs."""
    return tuple(sorted(given.items())) if isinstance(given, Mapping) else given


class Simulation(Frozen):
    """How a simulated rig is asked to carry out a scene; a real one ignores it."""

    effects: tuple[Annotated[str, Field(pattern=r"^[+-]?[a-z][a-z0-9-]*$")], ...] = ()
    """``+name`` includes an effect (or a group of them) whatever the plan would say, ``-name`` leaves it out, ``name``
    lets the plan decide; later ones win. ``+all`` and ``-all`` are every candidate. An effect of another package is a
    candidate only where it is named here or by the sensor."""
    rung: str | None = None
    """Name of a rung of the ladder of solvers; None: the default one."""
    tolerance: float | None = Field(default=None, gt=0)
    """Largest error of an observed channel, in its own unit; the cheapest rung that keeps it is taken. None: the
    rung's own."""
    scenario: str | None = None
    """Name of one of the sensor's scenarios, whose nuisances take the place of the usual ones; None: the usual ones."""

    nuisances: Annotated[tuple[tuple[str, float], ...], BeforeValidator(_pairs)] = ()
    """Nuisances by name with another value than the scene or the sensor states, as ``placement_scatter_mm: 0.3``."""

    @field_serializer("nuisances")
    def _as_mapping(self, nuisances: tuple[tuple[str, float], ...]) -> dict[str, float]:
        return dict(nuisances)

    @model_validator(mode="after")
    def _one_of_two(self) -> Simulation:
        if self.rung is not None and self.tolerance is not None:
            raise ValueError("give a rung or a tolerance, not both: a tolerance picks the rung")
        return self


class Scene(Frozen):
    """One recording to be made."""

    name: str
    """Short and unique within a task, fit for a file name."""
    indenter: Indenter = Indenter()
    placement: Placement = Placement()
    profile: ForceProfile = ForceRamp()
    drive: ForceLoop | None = None
    """How the force is brought about; None: the indenter follows the profile exactly."""
    slide: Slide | None = None
    """Tangential motion; None: the indenter is only pressed."""
    environment: Environment = Environment()
    session: str = "1"
    """Recordings of one session were made without re-mounting anything."""
    unit: str = Field(default="1", min_length=1)
    """Which unit of the sensor: two devices of one type are two units. The spec describes unit 1."""
    starts_after_s: float = Field(default=0.0, ge=0)
    """Seconds from the session's first sample to this recording's first."""
    observe: tuple[ChannelKind, ...] = ("taxel",)
    """Kinds of channels that somebody will look at; the reference force is always recorded."""
    simulation: Simulation = Simulation()
    labels: dict[str, str | float | int] = Field(default_factory=dict)
    """Facts about the recording that a task may ask for, for example {"cap_radius_mm": 5.0}."""

    @property
    def first_unit(self) -> bool:
        """Whether the unit is the one whose rest levels and gain the sensor's spec describes."""
        return self.unit == "1"

    def nuisances(self) -> dict[str, float]:
        """Return what the scene states of nuisances, by name and in the unit of the name."""
        found = {}
        for name, (way, unit) in NUISANCES.items():
            value: Any = self
            for part in way:
                value = getattr(value, part, None)
            if value is not None:
                found[name] = value.to(unit) if isinstance(value, Quantity) else float(value)
        return found

    def with_nuisances(self, values: Mapping[str, float]) -> Scene:
        """Return the scene with other `values` of nuisances, by name; names that are not a scene's are passed over.

        Raises
        ------
        UsageError
            If a nuisance cannot have its value, or the scene lacks the part that it is of.
        """
        by_part: dict[tuple[str, ...], dict[str, float]] = {}
        for name, value in values.items():
            if name in NUISANCES:
                if value < 0 and name not in _MAY_BE_NEGATIVE:
                    raise UsageError(f"{name} = {value:g} is below 0.", hint="Give 0 or more.")
                by_part.setdefault(NUISANCES[name][0][:-1], {})[name] = value
        scene = self
        for way, given in by_part.items():
            scene = _with(scene, way, given)
        return scene

    def simulated_as(self, simulation: Simulation) -> Scene:
        """Return the scene as a simulated rig is asked to carry it out; raises as `with_nuisances`.

        The scene's own words about effects stand before those of `simulation`.
        """
        if simulation == Simulation():
            return self
        every = simulation.model_copy(update={"effects": (*self.simulation.effects, *simulation.effects)})
        return self.with_nuisances(dict(simulation.nuisances)).model_copy(update={"simulation": every})


def _with(model: M, way: tuple[str, ...], given: Mapping[str, float]) -> M:
    """Return a copy of `model` with nuisances of the part at `way`, checked as any other numbers."""
    if way:
        inside = getattr(model, way[0])
        if inside is None:
            raise UsageError(f"{', '.join(given)}: the scene has no {way[0]}.", hint="Leave it out.")
        return model.model_copy(update={way[0]: _with(inside, way[1:], given)})
    change: dict[str, Quantity | float] = {}
    for name, value in given.items():
        path, unit = NUISANCES[name]
        is_quantity = "Quantity" in str(type(model).model_fields[path[-1]].annotation)
        change[path[-1]] = assumed(value, unit, "set for this run") if is_quantity else value
    try:
        return type(model).model_validate({**dict(model), **change})
    except ValidationError as error:
        listed = ", ".join(f"{name} = {value:g}" for name, value in given.items())
        raise UsageError(f"{listed}: {complaint(error)}.", hint="Give another value.") from error


_PARTS: tuple[tuple[tuple[str, ...], type[Frozen]], ...] = (
    (("environment",), Environment), (("placement",), Placement), (("drive",), ForceLoop),
    (("slide", "surface"), Surface),
)  # fmt: skip
_UNITS = {"force_filter": "Hz", "indenter_temperature": "degC", "rate": "Hz"}
"""Units of the fields that state no number."""


def _nuisances() -> Iterator[tuple[str, tuple[tuple[str, ...], str]]]:
    for way, model in _PARTS:
        for field, info in model.model_fields.items():
            if isinstance(info.default, Quantity) or field in _UNITS:
                unit = _UNITS.get(field) or info.default.unit
            elif "float" in str(info.annotation):
                unit = "1"
            else:
                continue
            prefix = "" if way == ("environment",) else f"{way[-1]}_"
            yield units.with_unit(f"{prefix}{field}", unit), ((*way, field), unit)


NUISANCES: Mapping[str, tuple[tuple[str, ...], str]] = dict(_nuisances())
"""Numbers of a scene that no source states well enough: where each stands, and its unit, by its one name.

The name is field and unit, behind the part of the scene where that is not the environment: ``since_power_on_s``,
``placement_scatter_mm``, ``drive_delay_ms``, ``surface_roughness_um``. Options, files, recordings and tables use it.
"""

RANGES = ranges(
    ("placement_scatter_mm", 0.0, 0.5, "mm", "assumed", "a machined seat … one fitted by hand"),
    ("placement_tilt_scatter_deg", 0.0, 1.0, "deg", "assumed", "none … 0.2 mm across a cap of 12 mm"),
)
"""Between what ends nuisances of the mount may lie, by name; a sensor's spec has its own."""

_MAY_BE_NEGATIVE = frozenset({
    "ambient_degc", "indenter_temperature_degc", "placement_x_mm", "placement_s_mm", "placement_tilt_x_rad",
    "placement_tilt_s_rad",
})  # fmt: skip

"""Scenes: indenter, placement, force profile and environment of one recording."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import (
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
from tactbench.core.spec.profile import PAPER, ForceProfile, ForceRamp
from tactbench.core.spec.quantity import Frozen, Quantity, assumed, derived, measured, sourced
from tactbench.core.spec.sensor import ChannelKind, ranges

Role = Literal["train", "validation", "test"]
"""Role of a recording in a task, as training or test data."""


class Indenter(Frozen):
    """The body pressed on the sensor: flat, a spherical cap, or a shape from a plugin."""

    radius: Quantity | None = None
    """Radius of the cap [length]; None: the surface is flat or of another shape."""
    shape: str | None = None
    """Name of an installed shape (``tactbench list indenters``). None, ``cap`` or ``flat``: a cap if a radius is given,
    else a flat surface."""
    dimensions: dict[str, Quantity] = Field(default_factory=dict)
    """Dimensions of the shape by name; omitted dimensions have their defaults."""
    angle: Quantity = assumed(0.0, "deg", "the shape's own axes are those of the sensor")
    """Rotation of the indenter's shape about the press axis, from x towards s [angle]."""

    @model_validator(mode="before")
    @classmethod
    def _cap_and_flat(cls, given: Any) -> Any:
        """Return the indenter in its stored form, in which caps and flat surfaces are given by the radius alone."""
        if not isinstance(given, Mapping) or given.get("shape") not in ("cap", "flat"):
            return given
        own, dimensions = dict(given), dict(given.get("dimensions") or {})
        is_cap = own.pop("shape") == "cap"
        if is_cap:
            own.setdefault("radius", dimensions.pop("radius", None))
        if is_cap == (own.get("radius") is None):
            raise ValueError("radius: the shape cap needs a radius, and the shape flat takes no radius")
        return {**own, "dimensions": dimensions}

    @model_validator(mode="after")
    def _is_one_body(self) -> Indenter:
        if self.shape is not None and self.radius is not None:
            raise ValueError(f"radius: only a cap has a radius; {self.shape!r} is sized by `dimensions`")
        if self.shape is None and self.dimensions:
            raise ValueError(f"dimensions: {', '.join(self.dimensions)} given for {self}, which has none; give `shape`")
        if self.angle.to("rad") and self.shape is None:
            raise ValueError(f"angle: {self.angle} is given, and {self} has rotational symmetry; leave `angle` out")
        return self

    @model_serializer(mode="wrap")
    def _stored_form(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Return the stored form: caps and flat surfaces are given by a radius only, as in earlier recordings."""
        stored: dict[str, Any] = serialize(self)
        return stored if self.shape is not None else {"radius": stored["radius"]}

    def __str__(self) -> str:
        if self.shape is None:
            return f"cap R {self.radius}" if self.radius else "flat"
        sizes = ", ".join(f"{name} {size}" for name, size in self.dimensions.items())
        turned = f"turned by {self.angle}" if self.angle.value else ""
        return ", ".join(filter(None, (f"{self.shape} {sizes}".strip(), turned)))


_PAPER_LOOP = "Karl et al. 2016 state a low-pass filter in the loop; neither controller, gains nor motor"


class ForceLoop(Frozen):
    """A force loop around a position-controlled linear motor.

    Once per step, the force is read and filtered, and a proportional-integral controller turns its difference from
    the profile into a position command. The defaults are plausible; the paper states none of them.
    """

    kind: Literal["force loop"] = "force loop"
    proportional: Quantity = assumed(0.15, "mm/N", _PAPER_LOOP)
    """Proportional gain: position for each newton of missing force [length / force]."""
    integral: Quantity = assumed(1.0, "mm/N/s", _PAPER_LOOP)
    """Integral gain: speed for each newton of missing force [length / force / time]."""
    cutoff: Quantity | None = assumed(1.0, "Hz", f"{_PAPER_LOOP}: no cut-off either")
    """Cut-off of the first-order low-pass on the measured force [1/time]; None: there is no filter."""
    rate: Quantity | None = None
    """Rate of the control loop [1/time]; None: the rate of the reference clock."""
    delay: Quantity = assumed(
        10.0, "ms", "RS232, as the paper says, at 9600 baud: a command and its answer of 9 to 10 bytes of 10 bits"
    )
    """Time between reading the force and the arrival of the command at the motor [time], rounded up to whole steps."""
    motor_lag: Quantity = assumed(10.0, "ms", "closed position loop of a small linear motor; no source")
    """Time constant with which the motor approaches a commanded position [time]."""
    speed: Quantity = assumed(50.0, "mm/s", "small linear motors reach metres per second; set low for pressing")
    """Largest speed of the motor [length / time]."""
    acceleration: Quantity = assumed(1000.0, "mm/s/s", "a tenth of gravity; drives allow it to be set")
    """Largest acceleration of the motor [length / time^2]."""
    resolution: Quantity = derived(
        0.02, "N", "12 bits on +-10 V of a Nano17 with 3.7 N/V in its worst gauge, upper end of 8 to 20 mN"
    )
    """Resolution of the force measurement [force]."""


class Placement(Frozen):
    """Position and tilt of the indenter relative to the sensor's nominal point of contact."""

    x: Quantity = assumed(0.0, "mm", "nominal contact point of the mount")
    """Offset of the indenter along the finger's axis [length]."""
    s: Quantity = assumed(0.0, "mm", "nominal contact point of the mount")
    """Offset of the indenter along the arc of the skin [length]."""
    scatter: Quantity = assumed(
        0.1, "mm", "repeatability of exchanging a cap; no source states it: docs/calibration.md draws it from a prior"
    )
    """Standard deviation of both offsets between recordings [length]."""
    tilt_x: Quantity = assumed(0.0, "rad", "the indenter's axis is the press axis")
    """Slope of the indenter along the finger [angle]; if positive, the gap is wider towards the tip."""
    tilt_s: Quantity = assumed(0.0, "rad", "the indenter's axis is the press axis")
    """Slope of the indenter across the finger, along the arc [angle]."""
    tilt_scatter: Quantity = assumed(
        0.0, "deg", "no source states how an exchanged cap tilts; `RANGES` has what may be"
    )
    """Standard deviation of both slopes between recordings [angle]."""


class Environment(Frozen):
    """Surroundings of the contact, and factors that scale the assumed noise and drift."""

    since_power_on: Quantity = assumed(
        3600.0, "s", "an hour: warm; the paper does not say: docs/calibration.md draws it from a prior"
    )
    """Time from switching the sensor on to the session's first sample [time]."""
    noise_scale: float = Field(default=1.0, ge=0)
    """Factor on the white noise of the sensor; docs/calibration.md has factors that fit the paper's figures."""
    drift_scale: float = Field(default=1.0, ge=0)
    """Factor on slow drift and warm-up, and on the offsets that have no factor of their own."""
    offset_scale: float | None = Field(default=None, ge=0)
    """Factor on the offsets between recordings of a session; None: the same factor as for drift."""
    session_offset_scale: float = Field(default=0.0, ge=0)
    """Factor on the offsets between sessions; 0: all sessions share one warm set-up, as in the paper."""
    force_noise: Quantity = sourced(
        0.6875, "N", f"{PAPER}: RMSE of the regression on the time index, read as label noise"
    )
    """Standard deviation of the noise of the force-torque sensor, without a filter [force]."""
    force_filter: Quantity | None = None
    """Cut-off of a low-pass filter on the recorded force [1/time]; None: no filter, as in the paper."""
    ambient: Quantity = assumed(23.0, "degC", "a laboratory; the paper does not say")
    """Temperature of the room [degC]."""
    indenter_temperature: Quantity | None = None
    """Temperature of the indenter [degC]; None: that of the surface it touches, so that no heat flows. No source states
    the temperature; a cap may be as warm as the room."""

    @property
    def scale_of_offsets(self) -> float:
        """Factor on the offsets between recordings of a session [1]."""
        return self.drift_scale if self.offset_scale is None else self.offset_scale


class Surface(Frozen):
    """Friction and roughness of the indenter's surface, which slides over the skin."""

    static_friction: Quantity = sourced(
        0.7834, "1", "NVlabs/biotac_sim, sim_biotac.py: default coefficient for a BioTac, read as the static one"
    )
    """Ratio of tangential to normal force above which the whole contact slips [1]."""
    kinetic_friction: Quantity = assumed(0.65, "1", "a sixth below the static coefficient; no source for this skin")
    """Ratio of tangential to normal force at speeds far above `stribeck_speed` [1]."""
    stribeck_speed: Quantity = assumed(5.0, "mm/s", "no source for this skin")
    """Speed over which friction falls from static to kinetic [speed]; 0: the fall is immediate (Coulomb)."""
    roughness: Quantity = measured(
        73.0,
        "um",
        "set so that PAC holds 110 counts (rms) between 2 and 30 Hz, the median of dexrob/BioTac_slide_20_50, in one "
        "simulated slide: cap R 20 mm, 0.5 N, 50 mm/s, all three assumed",
    )
    """Root mean square of the roughness profile [length]."""
    roll_off: Quantity = assumed(
        1.0, "mm", "some tenths of a millimetre and more, by surface: Persson et al. 2005; none known of what slides"
    )
    """Wavelength below which the roughness is self-affine, and above which its spectrum is constant [length]."""
    hurst: Quantity = assumed(
        0.8, "1", "0.7 to 0.9 for most surfaces; Persson et al. 2005, J. Phys.: Condens. Matter 17 R1, as recalled"
    )
    """Hurst exponent H of the roughness [1]: its spectrum falls as k^-(1 + 2 H)."""

    @model_validator(mode="before")
    @classmethod
    def _read_earlier_form(cls, given: Any) -> Any:
        """Return the surface of an earlier recording, whose roughness was a narrow band, with that as its roll-off."""
        if isinstance(given, Mapping) and "wavelength" in given:
            left = {name: value for name, value in given.items() if name != "spread"}
            return {"roll_off": left.pop("wavelength"), **left}
        return given

    @model_validator(mode="after")
    def _is_physical(self) -> Surface:
        static, kinetic = self.static_friction.to("1"), self.kinetic_friction.to("1")
        if not static >= kinetic >= 0:
            raise ValueError(f"friction must be static >= kinetic >= 0, not {static:g} and {kinetic:g}")
        if self.stribeck_speed.to("mm/s") < 0 or self.roughness.to("mm") < 0:
            raise ValueError("a Stribeck speed and a roughness must be 0 or more")
        if not (self.roll_off.to("mm") > 0 and 0 < self.hurst.to("1") <= 1):
            raise ValueError("a roll-off must be above 0, a Hurst exponent above 0 and at most 1")
        return self


class Slide(Frozen):
    """Tangential motion of the indenter at constant speed, which is at rest before and after."""

    speed: Quantity
    """Speed of the indenter relative to the sensor's core [speed], above zero."""
    direction: Quantity = assumed(0.0, "deg", "along the finger, towards the tip")
    """Direction of the motion [angle]: 0 is along x, 90 deg along s."""
    start: Quantity = assumed(30.0, "s", "the middle of a recording of the paper's length")
    """Start of the motion, counted from the first sample of the recording [time]."""
    duration: Quantity | None = None
    """Duration of the motion [time]; None: to the end of the recording."""
    surface: Surface = Surface()

    @model_validator(mode="after")
    def _is_motion(self) -> Slide:
        if not self.speed.to("mm/s") > 0 or self.start.to("s") < 0:
            raise ValueError("a slide must have a speed above 0 and start at 0 s or later")
        if self.duration is not None and not self.duration.to("s") > 0:
            raise ValueError("a slide must last longer than 0 s")
        self.direction.to("rad")
        return self

    def __str__(self) -> str:
        return f"{self.speed} from {self.start} on"


def _pairs(given: Any) -> Any:
    """Return a mapping as its sorted pairs, and any other value unchanged."""
    return tuple(sorted(given.items())) if isinstance(given, Mapping) else given


class Simulation(Frozen):
    """Settings with which a simulated rig carries out a scene; a real rig ignores them."""

    effects: tuple[Annotated[str, Field(pattern=r"^[+-]?[a-z][a-z0-9-]*$")], ...] = ()
    """Choice of effects, in which later entries override earlier ones: ``+name`` always includes an effect or a group,
    ``-name`` excludes it, and ``name`` leaves the choice to the plan. ``+all`` and ``-all`` are all candidates. An
    effect of another package is a candidate only if it is named here or by the sensor."""
    rung: str | None = None
    """Name of a solver setting, from a ladder of accuracy and cost; None: the default."""
    tolerance: float | None = Field(default=None, gt=0)
    """Largest error of an observed channel, in its unit, by which the cheapest solver is chosen; None: no choice."""
    scenario: str | None = None
    """Name of one of the sensor's scenarios, whose nuisances replace the usual ones; None: the usual ones."""

    nuisances: Annotated[tuple[tuple[str, float], ...], BeforeValidator(_pairs)] = ()
    """Values of nuisances by name, instead of the values of the scene or the sensor: ``placement_scatter_mm: 0.3``."""

    @field_serializer("nuisances")
    def _as_mapping(self, nuisances: tuple[tuple[str, float], ...]) -> dict[str, float]:
        return dict(nuisances)

    @model_validator(mode="after")
    def _one_of_two(self) -> Simulation:
        if self.rung is not None and self.tolerance is not None:
            raise ValueError("give a rung or a tolerance, not both: a tolerance chooses the rung")
        return self


class Scene(Frozen):
    """Description of one recording: the bodies, their motions and the settings."""

    name: str
    """Name of the scene: short, unique within a task, and valid as a file name."""
    indenter: Indenter = Indenter()
    placement: Placement = Placement()
    profile: ForceProfile = ForceRamp()
    drive: ForceLoop | None = None
    """Force loop that drives the indenter; None: the force follows the profile without error."""
    slide: Slide | None = None
    """Tangential motion of the indenter; None: it presses without sliding."""
    environment: Environment = Environment()
    session: str = "1"
    """Name of the session; within a session, nothing is mounted anew between recordings."""
    unit: str = Field(default="1", min_length=1)
    """Number of the sensor unit: two devices of one type are two units. The spec describes unit 1."""
    starts_after_s: float = Field(default=0.0, ge=0)
    """Time from the first sample of the session to the first sample of this recording [s]."""
    observe: tuple[ChannelKind, ...] = ("taxel",)
    """Kinds of channels to record beside the reference force."""
    simulation: Simulation = Simulation()
    labels: dict[str, str | float | int] = Field(default_factory=dict)
    """Labels of the recording for use by tasks: {"cap_radius_mm": 5.0}."""

    @property
    def first_unit(self) -> bool:
        """True if the unit is unit 1, whose rest levels and gain the sensor's spec describes."""
        return self.unit == "1"

    def nuisances(self) -> dict[str, float]:
        """Return the scene's nuisances as numbers by name, each in the unit in its name."""
        found = {}
        for name, (way, unit) in NUISANCES.items():
            value: Any = self
            for part in way:
                value = getattr(value, part, None)
            if value is not None:
                found[name] = value.to(unit) if isinstance(value, Quantity) else float(value)
        return found

    def with_nuisances(self, values: Mapping[str, float]) -> Scene:
        """Return the scene with `values` for its nuisances, given by name; unknown names are ignored.

        Raises UsageError if a nuisance cannot have its value, or if the scene lacks its part, for example a drive.
        """
        given = {name: value for name, value in values.items() if name in NUISANCES}
        data = self.model_dump()
        for name, value in given.items():
            if value < 0 and name not in _MAY_BE_NEGATIVE:
                raise UsageError(f"{name} = {value:g} is below 0.", hint="Give 0 or more.")
            (*parts, field), unit = NUISANCES[name]
            inside = data
            for part in parts:
                if inside[part] is None:
                    raise UsageError(f"{name}: the scene has no {part}.", hint=f"Leave {name} out.")
                inside = inside[part]
            is_quantity = isinstance(inside[field], Mapping) or field in _UNITS
            inside[field] = assumed(value, unit, "set for this run") if is_quantity else value
        try:
            return Scene.model_validate(data) if given else self
        except ValidationError as error:
            listed = ", ".join(f"{name} = {value:g}" for name, value in given.items())
            raise UsageError(f"{listed}: {complaint(error)}.", hint="Give another value.") from error

    def simulated_as(self, simulation: Simulation) -> Scene:
        """Return the scene with the settings `simulation` of a simulated rig; raises the errors of `with_nuisances`.

        Entries for effects in the scene come before those in `simulation`, which override them.
        """
        if simulation == Simulation():
            return self
        every = simulation.model_copy(update={"effects": (*self.simulation.effects, *simulation.effects)})
        return self.with_nuisances(dict(simulation.nuisances)).model_copy(update={"simulation": every})


_PARTS: tuple[tuple[tuple[str, ...], type[Frozen]], ...] = (
    (("environment",), Environment), (("placement",), Placement), (("drive",), ForceLoop),
    (("slide", "surface"), Surface),
)  # fmt: skip
_UNITS = {"force_filter": "Hz", "indenter_temperature": "degC", "rate": "Hz"}
"""Units of those fields whose default value is None."""


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
"""Numbers of a scene that no source states well enough, by name, each with its place in the scene and its unit.

The name is made of part of the scene (except the environment), field and unit: ``since_power_on_s``,
``placement_scatter_mm``, ``drive_delay_ms``, ``surface_roughness_um``. Options, files, recordings and tables use it.
"""

RANGES = ranges(
    ("placement_scatter_mm", 0.0, 0.5, "mm", "assumed", "a machined seat … one fitted by hand"),
    ("placement_tilt_scatter_deg", 0.0, 1.0, "deg", "assumed", "none … 0.2 mm across a cap of 12 mm"),
)
"""Ranges of the nuisances of the mount, by name; ranges of a sensor's own nuisances are in its spec."""

_MAY_BE_NEGATIVE = frozenset({
    "ambient_degc", "indenter_temperature_degc", "placement_x_mm", "placement_s_mm", "placement_tilt_x_rad",
    "placement_tilt_s_rad",
})  # fmt: skip

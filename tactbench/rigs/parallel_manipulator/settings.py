"""What a rig file says under `settings:` of this rig, checked: nothing is moved by a file that lacks a limit.

Plain numbers, each with its unit in its name; here is the border where they become SI. Positions of the motor are
positive into the skin.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, field_validator, model_validator

from tactbench.plugin import ForceLoop, Quantity, UsageError, sourced
from tactbench.plugin.devices import ForceLaw, NamedDevice, RigFile
from tactbench.rigs.parallel_manipulator.geometry import Geometry
from tactbench.rigs.parallel_manipulator.motion_profile import MotionLimits
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.options import read_options
from tactbench.rigs.parallel_manipulator.press_moves import PressHeights
from tactbench.rigs.parallel_manipulator.singularity import PostureLimits

MOTOR = "motor"
"""Name of the linear motor's entry under `devices:`."""
JOINTS = ("joint-1", "joint-2", "joint-3")
"""Names of the entries of the manipulator's drives, in the order of its legs."""
BEATS = 3
"""Control periods without a beat after which the guard retreats, at least (derived: rig practice of two to three)."""
LEAST_HEARTBEAT_S = 0.02
"""Shorter limits trip falsely: sleeps on an ordinary kernel are late by up to 9.4 ms (measured)."""

Positive = Annotated[FiniteFloat, Field(gt=0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0)]
Range = tuple[FiniteFloat, FiniteFloat]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


def _from_rig_file(value: float, unit: str) -> Quantity:
    return sourced(value, unit, "the rig file")


class SafetyLimits(_Part):
    """What is never exceeded; all but the torque must be stated."""

    force_ceiling_n: Positive
    """Norm of the raw force, in one sample, at which the motor retreats."""
    torque_ceiling_nm: Positive | None = None
    """Norm of the raw torque; None: torque is not looked at."""
    rated_force_n: Positive
    """What the weakest part bears: skin, sensor, force sensor, cap. By its data sheet."""
    travel_mm: Range
    """Least and greatest position of the motor; 0 lies between them, where the drive keeps them."""
    homing_force_n: Positive = 0.2
    """Norm of the raw force that ends homing and retracting: above noise and drift, well below a press (assumed)."""
    heartbeat_ms: Positive
    """The motor retreats if nobody has told it for so long to go on."""
    retreat_mm: FiniteFloat
    """Position of the motor away from the skin: where it waits, and where it goes whatever is wrong."""
    retreat_speed_mm_s: Positive

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        low, high = self.travel_mm
        if not low < 0 < high:
            raise ValueError("the motor's travel goes from below 0 to above 0")
        if not low <= self.retreat_mm < high:
            raise ValueError("the motor retreats to a place outside its travel")
        if self.rated_force_n <= self.force_ceiling_n:
            raise ValueError("the ceiling is not below the rated force")
        return self


class Stiffness(_Part):
    """How stiff skin, cap and machine in series are, N/mm; declared, since nobody can compute it beforehand."""

    least_n_mm: Positive
    """At the first touch of the softest cap."""
    at_touch_n_mm: Positive
    """The greatest up to the force that a first touch may have."""
    greatest_n_mm: Positive
    """At the largest commanded force on the stiffest cap: what the loop must settle at."""
    at_ceiling_n_mm: Positive
    """At the ceiling: what a reaction that comes late costs."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.least_n_mm <= self.at_touch_n_mm <= self.greatest_n_mm <= self.at_ceiling_n_mm:
            raise ValueError("least, at a touch, greatest and at the ceiling rise in this order")
        return self


class ForceControl(_Part):
    """The force loop."""

    rate_hz: Positive
    """Control periods a second; each is a beat for the guard."""
    proportional_mm_n: NotNegative = 0.0
    integral_mm_n_s: NotNegative
    cutoff_hz: Positive | None
    """Of the first-order low-pass on the regulated force; null: unfiltered."""
    delay_ms: NotNegative
    """From a force sample to the drive's having the command: line time, answers, a control period's phase."""
    motor_lag_ms: NotNegative
    """Time constant of the drive's position loop."""
    speed_mm_s: Positive
    """Largest speed of the loop: 2 to 5 times what the ramp needs at the softest place."""
    windup_ms: Positive = 200.0
    """Times `speed_mm_s` is how far the target may be ahead of the measured position."""
    feed_forward_n_mm: Positive | None = None
    """Assumed stiffness for the ramp's feed-forward; null: none."""

    @property
    def period_s(self) -> float:
        """Control period [s]."""
        return 1 / self.rate_hz

    @property
    def step_m(self) -> float:
        """Largest increment in a control period [m]."""
        return 1e-3 * self.speed_mm_s / self.rate_hz

    def loop(self) -> ForceLoop:
        """Return the loop as scenes state it."""
        return ForceLoop(
            proportional=_from_rig_file(self.proportional_mm_n, "mm/N"),
            integral=_from_rig_file(self.integral_mm_n_s, "mm/N/s"),
            cutoff=None if self.cutoff_hz is None else _from_rig_file(self.cutoff_hz, "Hz"),
            rate=_from_rig_file(self.rate_hz, "Hz"),
            delay=_from_rig_file(self.delay_ms, "ms"),
            motor_lag=_from_rig_file(self.motor_lag_ms, "ms"),
            speed=_from_rig_file(self.speed_mm_s, "mm/s"),
        )

    def law(self, travel_mm: Range) -> ForceLaw:
        """Return the law within a travel of the motor."""
        return ForceLaw.of(
            self.loop(),
            speed=1e-3 * self.speed_mm_s,
            windup_s=1e-3 * self.windup_ms,
            travel=(1e-3 * travel_mm[0], 1e-3 * travel_mm[1]),
            feed_forward=math.inf if self.feed_forward_n_mm is None else 1e3 * self.feed_forward_n_mm,
        )


class Touch(_Part):
    """How the surface is found."""

    speed_mm_s: Positive
    """On the way to the expected surface, out of its reach."""
    touch_speed_mm_s: Positive
    """From there on."""
    acceleration_mm_s2: Positive
    """Of starting and braking."""
    single_n: Positive
    """A touch: two of three raw samples above it. Well above the force sensor's noise."""
    mean_n: Positive
    """A touch as well: the mean of the raw samples of the last `mean_ms` above it."""
    mean_ms: Positive
    """One control period or more; the noise of a mean falls with its root."""
    allowed_n: Positive
    """The largest force of a first touch that is acceptable."""
    contact_n: Positive
    """The force that is kept after the touch, until the place of the surface is known; and the least on the ramp."""
    settle_s: Positive
    """How long."""
    lift_mm: Positive
    """How far the motor goes back from that place for the unloaded hold."""


class PressRules(_Part):
    """What ends a press before its time, and how it ends."""

    error_band_n: Positive
    """Filtered force this far from the wanted one for a second: retreat. Also the least height of a growing swing."""
    band_n: Positive
    """Filtered forces below it count as no force: above the noise of the filtered force."""
    lost_s: Positive
    """Contact is lost if the force is in the band for so long while more than twice the band is wanted."""
    hold_s: NotNegative = 0.0
    """How long the largest force is held after the scene's profile."""
    unload_speed_mm_s: Positive
    stale_ms: Positive = 100.0
    """The sensor's rows may be this old, as received; older: retreat."""


class Heights(_Part):
    """Where the sensor's surface is expected below the indenter."""

    surface_mm: FiniteFloat
    """Height of the manipulator at which the retracted indenter would touch; 0 where it is fixed."""
    surface_spread_mm: NotNegative
    """Standard deviation of the surface's height."""
    cap_tolerance_mm: NotNegative
    """Of a cap's length, from cap to cap."""
    stand_off_mm: Positive
    """Between tip and expected surface before the motor approaches."""
    clearance_mm: Positive
    """Between tip and expected surface on sideways moves."""
    depth_mm: Positive
    """How far below the expected surface the motor may go."""

    def heights(self) -> PressHeights:
        """Return them as moves use them."""
        names = ("surface", "surface_spread", "cap_tolerance", "stand_off", "clearance", "depth")
        return PressHeights(**{name: _from_rig_file(getattr(self, f"{name}_mm"), "mm") for name in names})

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        self.heights()
        return self


class Places(_Part):
    """Where the manipulator goes for a scene: the sensor's nominal contact point and the scene's offset from it."""

    x_mm: FiniteFloat = 0.0
    """Manipulator's x with the indenter above the nominal contact point."""
    y_mm: FiniteFloat = 0.0
    turned_deg: FiniteFloat = 0.0
    """Direction of the sensor's x in the manipulator's plane; its s is 90 deg further."""
    reach_x_mm: Range = (0.0, 0.0)
    """Offsets that scenes may ask for along the sensor; all of the rectangle is tested beforehand."""
    reach_s_mm: Range = (0.0, 0.0)
    """Offsets along its arc; laid out flat."""
    scatter_mm: NotNegative = 0.0
    """Radius of the disc in which each press's place is drawn, evenly, about the one asked for."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        for low, high in (self.reach_x_mm, self.reach_s_mm):
            if not low <= 0 <= high:
                raise ValueError("reaches go from 0 or less to 0 or more")
        return self

    def place_m(self, x_mm: float, s_mm: float) -> tuple[float, float]:
        """Return the manipulator's x and y [m] for offsets on the sensor."""
        turned = math.radians(self.turned_deg)
        x = self.x_mm + math.cos(turned) * x_mm - math.sin(turned) * s_mm
        y = self.y_mm + math.sin(turned) * x_mm + math.cos(turned) * s_mm
        return 1e-3 * x, 1e-3 * y

    def corners_m(self) -> list[tuple[float, float]]:
        """Return the four corners of all that may be asked for, scatter included, in turn [m]."""
        (x0, x1), (s0, s1), more = self.reach_x_mm, self.reach_s_mm, self.scatter_mm
        x0, x1, s0, s1 = x0 - more, x1 + more, s0 - more, s1 + more
        return [self.place_m(*at) for at in ((x0, s0), (x1, s0), (x1, s1), (x0, s1))]


class JointMotion(_Part):
    """How the manipulator's platform moves."""

    speed_mm_s: Positive = 20.0
    acceleration_mm_s2: Positive = 200.0
    jerk_mm_s3: Positive = 2000.0
    way_point_mm: Positive = 1.0
    """The line is kept by points at most so far apart, at each of which all joints come to rest."""

    def limits(self) -> MotionLimits:
        """Return the limits of a move."""
        return MotionLimits(
            speed=_from_rig_file(self.speed_mm_s, "mm/s"),
            acceleration=_from_rig_file(self.acceleration_mm_s2, "mm/s/s"),
            jerk=_from_rig_file(self.jerk_mm_s3, "mm/s/s/s"),
        )


class Postures(_Part):
    """How near a singularity the manipulator may go."""

    serial: Annotated[FiniteFloat, Field(ge=0.01, lt=1)] = 0.15
    parallel: Annotated[FiniteFloat, Field(ge=0.01, lt=1)] = 0.15
    constraint: Annotated[FiniteFloat, Field(ge=0.01, lt=1)] = 0.15
    sideways_deg: Annotated[FiniteFloat, Field(gt=0, lt=90)] = 30.0

    def limits(self) -> PostureLimits:
        """Return the limits of the workspace."""
        return PostureLimits(
            serial=_from_rig_file(self.serial, "1"),
            parallel=_from_rig_file(self.parallel, "1"),
            constraint=_from_rig_file(self.constraint, "1"),
            sideways=_from_rig_file(self.sideways_deg, "deg"),
        )


class RigSettings(_Part):
    """All that this rig is told beside its devices."""

    limits: SafetyLimits
    manipulator: Literal["fixed"] | Geometry
    """`fixed`: somebody puts the sensor below the indenter, and nothing but the motor moves."""
    heights: Heights
    places: Places = Places()
    motion: JointMotion = JointMotion()
    postures: Postures = Postures()
    stiffness: Stiffness
    force_loop: ForceControl
    touch: Touch
    press: PressRules
    guard_log: str = "tactbench-guard.log"
    """File to which the guard's process adds a line an event, also when the rig's own process is lost."""

    @model_validator(mode="after")
    def _together(self) -> Self:
        limits, loop, touch = self.limits, self.force_loop, self.touch
        least = max(1e3 * BEATS * loop.period_s, 1e3 * LEAST_HEARTBEAT_S)
        highest = limits.travel_mm[1]
        for wrong, problem in (
            (limits.heartbeat_ms < least, f"a heartbeat below {least:g} ms trips falsely at {loop.rate_hz:g} Hz"),
            (touch.single_n >= limits.force_ceiling_n, "a touch is not below the ceiling"),
            (touch.contact_n > touch.mean_n, "the force kept after a touch is not below that of a touch"),
            (touch.mean_ms < 1e3 * loop.period_s, "the mean of a touch is shorter than a control period"),
            (touch.touch_speed_mm_s > touch.speed_mm_s, "the touch is quicker than the way to it"),
            (self.press.error_band_n <= self.press.band_n, "the band of errors is not above that of no force"),
            (touch.lift_mm >= self.heights.stand_off_mm, "the lift is not within the stand-off"),
            (
                limits.retreat_mm + self.heights.stand_off_mm + self.heights.depth_mm > highest,
                "stand-off and depth below the place of retreat are beyond the motor's travel",
            ),
        ):  # fmt: skip
            if wrong:
                raise ValueError(problem)
        return self

    @property
    def surface_m(self) -> float:
        """Position of the motor at which the indenter is expected to touch [m]."""
        return 1e-3 * (self.limits.retreat_mm + self.heights.stand_off_mm)

    @property
    def deepest_m(self) -> float:
        """The greatest position that is ever asked for [m]."""
        return self.surface_m + 1e-3 * self.heights.depth_mm

    @property
    def near_m(self) -> float:
        """Where the motor goes over to the speed of touching [m]: three spreads and a cap's tolerance above it."""
        return self.surface_m - 1e-3 * (3 * self.heights.surface_spread_mm + self.heights.cap_tolerance_mm)


class ManipulatorFile(RigFile):
    """A rig file of this rig: complaints about its settings name their line."""

    settings: RigSettings  # type: ignore[assignment]

    @field_validator("devices")
    @classmethod
    def _has_a_motor(cls, devices: dict[str, NamedDevice]) -> dict[str, NamedDevice]:
        if MOTOR not in devices:
            raise ValueError(f"the rig presses with its {MOTOR!r}")
        return devices


def settings_of(file: RigFile) -> RigSettings:
    """Return the settings of a rig file that was read before.

    Raises
    ------
    UsageError
        If one is missing, not known or contradicts another, or a device is missing.
    """
    try:
        found = RigSettings.model_validate(file.settings)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(map(str, ("settings", *first["loc"])))
        message = "is missing" if first["type"] == "missing" else first["msg"].removeprefix("Value error, ")
        raise UsageError(
            f"{name} in the rig file: {message}.",
            hint="`tactbench doctor --rig-file FILE --seconds 0` names the line; see docs/hardware.md.",
        ) from error
    required = (MOTOR,) if found.manipulator == "fixed" else (MOTOR, *JOINTS)
    missing = [name for name in required if name not in file.devices]
    if missing or file.force is None:
        raise UsageError(
            f"The rig file has no {', '.join([*missing, *(['force'] if file.force is None else [])])}.",
            hint="See docs/hardware.md for the devices of this rig.",
        )
    return found


def with_limits(file: RigFile, settings: RigSettings) -> RigFile:
    """Return the file with the motor told the limits of the settings; raises UsageError if it was told others."""
    limits = settings.limits
    own = {
        "lower_m": 1e-3 * limits.travel_mm[0],
        "upper_m": 1e-3 * limits.travel_mm[1],
        "retreat_m": 1e-3 * limits.retreat_mm,
        "retreat_speed_m_s": 1e-3 * limits.retreat_speed_mm_s,
        "speed_m_s": 1e-3 * settings.touch.speed_mm_s,
        "acceleration_m_s2": 1e-3 * settings.touch.acceleration_mm_s2,
    }
    entry = file.devices[MOTOR]
    if entry.options.get("homing", "here") == "here":  # it stands at the place to which it retreats
        own["home_m"] = own["retreat_m"]
    for name, value in own.items():
        if name in entry.options and not math.isclose(float(entry.options[name]), value, rel_tol=1e-9):
            raise UsageError(
                f"The motor's option {name} is {entry.options[name]}, and the rig's limits make it {value:g}.",
                hint="State it once, under `settings: limits:` and `touch:`.",
            )
    motor = entry.model_copy(update={"options": {**entry.options, **own}})
    read_options(FaulhaberOptions, motor.options, "faulhaber")
    return file.model_copy(update={"devices": {**file.devices, MOTOR: motor}})

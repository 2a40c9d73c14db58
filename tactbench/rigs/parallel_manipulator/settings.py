"""The `settings:` of this rig in a rig file, checked: nothing is moved by a file that lacks a limit.

Plain numbers, each with its unit in its name, which become SI here. Positions of the motor are positive into the skin.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from tactbench.plugin import StreamSpec, UsageError, load_object
from tactbench.plugin.devices import (
    ForceLaw,
    LoopModel,
    NamedDevice,
    Options,
    Positioner,
    PressPlan,
    RigFile,
    read_options,
    samples,
)
from tactbench.rigs.parallel_manipulator.kinematics import LinearDelta

MOTOR = "motor"
"""Name of the pressing axis' entry under `devices:`."""
JOINTS = ("joint-1", "joint-2", "joint-3")
"""Names of the entries of the manipulator's rails, in the order of its legs."""
BEATS = 3
"""Control periods without a beat after which the guard retreats, at least (derived: rig practice of two to three)."""
LEAST_HEARTBEAT_S = 0.02
"""Shorter limits trip falsely: sleeps on an ordinary kernel are late by up to 9.4 ms (measured)."""
WINDUP_S = 0.2
"""Times the loop's speed: the distance by which its target may be ahead of the measured position (assumed)."""

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Range = tuple[float, float]


def _rising(names: str, *numbers: float) -> None:
    """Raise ValueError unless no number is below the one before."""
    if list(numbers) != sorted(numbers):
        raise ValueError(f"{names} do not rise in this order: {', '.join(f'{number:g}' for number in numbers)}")


class SafetyLimits(Options):
    """Limits that are never exceeded."""

    force_ceiling_n: Positive
    """Norm of the raw force, in one sample, at which the motor retreats while it presses."""
    travel_ceiling_n: Positive = 0.2
    """The same while the manipulator moves, and while any axis is homed or retracted: above noise and drift, well below
    a press (assumed)."""
    torque_ceiling_nm: Positive | None = None
    """Norm of the raw torque; None: torque is not limited."""
    rated_force_n: Positive
    """Load that the weakest part bears: skin, sensor, force sensor, cap. By its data sheet."""
    force_age_ms: Positive = 30.0
    """Largest age of a sample of the force: three sampling periods of the force sensor, and the delays of sender and
    host (assumed: 250 Hz or more, and an ordinary kernel)."""
    travel_mm: Range
    """Least and greatest position of the motor; between them lies the 0 of a Faulhaber drive."""
    heartbeat_ms: Positive
    """Time without a beat of the rig after which the motor retreats."""
    retreat_mm: float
    """Position of the motor away from the skin, where it waits and to which it retreats."""
    retreat_speed_mm_s: Positive

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        low, high = self.travel_mm
        _rising("the motor's travel and its place of retreat", low, self.retreat_mm, high)
        ceilings = (self.travel_ceiling_n, self.force_ceiling_n, self.rated_force_n)
        _rising("ceiling of travel, ceiling of pressing and rated force", *ceilings)
        return self


class Stiffness(Options):
    """Stiffness of skin, cap and machine in series, N/mm; declared, since it cannot be computed beforehand."""

    softest_n_mm: Positive
    """The least of any skin and cap, from the first touch on: force per way from any place to any deeper one. The lower
    it is, the later a force sensor that does not respond is noticed; above a skin's own, its presses are ended."""
    at_touch_n_mm: Positive
    """The greatest up to the force that a first touch may have."""
    greatest_n_mm: Positive
    """At the largest commanded force on the stiffest cap, where the loop must settle."""
    at_ceiling_n_mm: Positive
    """At the ceiling, where a late reaction adds force."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        stiffnesses = (self.softest_n_mm, self.at_touch_n_mm, self.greatest_n_mm, self.at_ceiling_n_mm)
        _rising("stiffness of the softest skin, at a touch, greatest, at the ceiling", *stiffnesses)
        return self


class ForceControl(Options):
    """The force loop."""

    rate_hz: Positive
    """Control periods a second, each with a beat for the guard."""
    proportional_mm_n: NotNegative = 0.0
    integral_mm_n_s: Positive
    cutoff_hz: Positive | None
    """Of the first-order low-pass on the regulated force; null: unfiltered."""
    delay_ms: NotNegative
    """From a force sample to the drive's receipt of the command: line time, answers, a control period's phase."""
    motor_lag_ms: NotNegative
    """Time constant of the drive's position loop."""
    speed_mm_s: Positive
    """Largest speed of the loop: 2 to 5 times that of the ramp at the softest place."""
    feed_forward_n_mm: Positive | None = None
    """Assumed stiffness for the ramp's feed-forward; null: none."""

    @property
    def step_m(self) -> float:
        """Largest increment in a control period [m]."""
        return 1e-3 * self.speed_mm_s / self.rate_hz

    def law(self, travel_mm: Range) -> ForceLaw:
        """Return the law within a travel of the motor."""
        return ForceLaw(
            period_s=1 / self.rate_hz,
            proportional=1e-3 * self.proportional_mm_n,
            integral=1e-3 * self.integral_mm_n_s,
            cutoff_hz=self.cutoff_hz,
            speed=1e-3 * self.speed_mm_s,
            windup_s=WINDUP_S,
            travel=(1e-3 * travel_mm[0], 1e-3 * travel_mm[1]),
            feed_forward=math.inf if self.feed_forward_n_mm is None else 1e3 * self.feed_forward_n_mm,
        )

    def model(self, travel_mm: Range) -> LoopModel:
        """Return the loop on a linear skin."""
        return LoopModel.around(self.law(travel_mm), lag_s=1e-3 * self.motor_lag_ms, delay_s=1e-3 * self.delay_ms)


class Touch(Options):
    """The search for the surface; see :class:`PressPlan`."""

    speed_mm_s: Positive
    """On the way to the expected surface, out of its reach."""
    touch_speed_mm_s: Positive
    """From there on."""
    acceleration_mm_s2: Positive
    """Of starting and braking."""
    single_n: Positive
    """A touch: two of three raw samples above it. Well above the force sensor's noise."""
    mean_n: Positive
    """A touch as well: the mean of the raw samples of the last `mean_ms` above it. Also the largest mean without touch:
    before the surface, after lifting off, and at the place of retreat."""
    mean_ms: Positive
    """One control period or more; the noise of a mean falls with its square root."""
    allowed_n: Positive
    """The largest force of a first touch that is acceptable."""
    contact_n: Positive
    """Force that is kept after the touch, until the place of the surface is known; and the least on the ramp."""
    settle_s: Positive
    """Time for which it is kept."""
    lift_mm: Positive
    """Distance of the motor from that place during the unloaded hold."""


class PressRules(Options):
    """The end of a press, also before its time; see :class:`PressPlan`."""

    error_band_n: Positive
    """Largest distance of the filtered force from the setpoint; above it for a second, the motor retreats."""
    unload_speed_mm_s: Positive
    """After the scene's ramp."""
    check_n: Positive | None = 3.0
    """Push by hand, or weight, with which an operator loads the force sensor before the first press of a session: it
    must be read with its sign, and within a factor of 1.5. null: not checked, as recordings state."""
    stale_ms: Positive = 100.0
    """Largest time without a row of the sensor; after it, the motor retreats."""


class Heights(Options):
    """Expected height of the sensor's surface below the indenter.

    Heights are those of the manipulator's point at which the tip of the retracted indenter would have that height.
    """

    surface_mm: float
    """Height of the manipulator at which the retracted indenter would touch; 0 where it is fixed."""
    tolerance_mm: NotNegative
    """Largest distance of the surface from there: three times its spread, and the differences of the caps' lengths."""
    stand_off_mm: Positive
    """Between tip and expected surface before the motor approaches."""
    clearance_mm: Positive
    """Between tip and expected surface on sideways moves."""
    depth_mm: Positive
    """Greatest depth of the motor below the expected surface."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        _rising("tolerance, stand-off and clearance", self.tolerance_mm, self.stand_off_mm, self.clearance_mm)
        return self

    @property
    def stand_off_m(self) -> float:
        """Height of the manipulator while the motor presses [m]."""
        return 1e-3 * (self.surface_mm + self.stand_off_mm)

    @property
    def clearance_m(self) -> float:
        """Height of the manipulator on sideways moves [m]."""
        return 1e-3 * (self.surface_mm + self.clearance_mm)


class Places(Options):
    """The manipulator's place for a scene: the sensor's nominal contact point and the scene's offset from it."""

    x_mm: float = 0.0
    """Manipulator's x with the indenter above the nominal contact point."""
    y_mm: float = 0.0
    turned_deg: float = 0.0
    """Direction of the sensor's x in the manipulator's plane; its s is 90 deg further."""
    reach_x_mm: Range = (0.0, 0.0)
    """Offsets that scenes may ask for along the sensor; all of the rectangle is tested beforehand."""
    reach_s_mm: Range = (0.0, 0.0)
    """Offsets along its arc; laid out flat."""

    def place_m(self, x_mm: float, s_mm: float) -> tuple[float, float]:
        """Return the manipulator's x and y [m] for offsets on the sensor."""
        turned = math.radians(self.turned_deg)
        x = self.x_mm + math.cos(turned) * x_mm - math.sin(turned) * s_mm
        y = self.y_mm + math.sin(turned) * x_mm + math.cos(turned) * s_mm
        return 1e-3 * x, 1e-3 * y

    def corners_m(self) -> list[tuple[float, float]]:
        """Return the four corners of the reach, in turn [m]."""
        (x0, x1), (s0, s1) = self.reach_x_mm, self.reach_s_mm
        return [self.place_m(*at) for at in ((x0, s0), (x1, s0), (x1, s1), (x0, s1))]


class RigSettings(Options):
    """All settings of this rig beside its devices."""

    limits: SafetyLimits
    manipulator: Literal["fixed"] | LinearDelta
    """`fixed`: the sensor is put below the indenter by hand, and only the motor moves."""
    heights: Heights
    places: Places = Places()
    stiffness: Stiffness
    force_loop: ForceControl
    touch: Touch
    press: PressRules
    guard_log: str = "tactbench-guard.log"
    """File to which the guard's process appends a line for each event, also when the rig's own process is lost."""

    @model_validator(mode="after")
    def _together(self) -> Self:
        limits, loop, touch, heights = self.limits, self.force_loop, self.touch, self.heights
        least_ms = 1e3 * max(BEATS / loop.rate_hz, LEAST_HEARTBEAT_S)
        deepest_mm = limits.retreat_mm + heights.stand_off_mm + heights.depth_mm
        found_mm = 1e3 * (self.found_m - self.surface_m)
        for names, *numbers in (
            ("three control periods (20 ms at least) and the heartbeat", least_ms, limits.heartbeat_ms),
            ("a control period and the time of a touch's mean", 1e3 / loop.rate_hz, touch.mean_ms),
            ("the force kept after a touch and that of a touch", touch.contact_n, touch.mean_n),
            ("a touch in a single sample and the ceiling", touch.single_n, limits.force_ceiling_n),
            ("the speed of the touch and of the way to it", touch.touch_speed_mm_s, touch.speed_mm_s),
            ("lift and stand-off", touch.lift_mm, heights.stand_off_mm),
            ("retreat, stand-off and depth together, and the motor's travel", deepest_mm, limits.travel_mm[1]),
            ("where the softest skin is touched (mean_n/softest_n_mm) and the depth", found_mm, heights.depth_mm),
        ):
            _rising(names, *numbers)
        return self

    @property
    def speeds_mm_s(self) -> tuple[float, ...]:
        """All speeds of the motor."""
        touch = self.touch
        return (touch.speed_mm_s, touch.touch_speed_mm_s, self.press.unload_speed_mm_s, self.limits.retreat_speed_mm_s)

    @property
    def surface_m(self) -> float:
        """Position of the motor at which the indenter is expected to touch [m]."""
        return 1e-3 * (self.limits.retreat_mm + self.heights.stand_off_mm)

    @property
    def deepest_m(self) -> float:
        """The greatest commanded position [m]."""
        return self.surface_m + 1e-3 * self.heights.depth_mm

    @property
    def touch_way_m(self) -> float:
        """Way into the softest skin until its mean force is a touch [m]."""
        return 1e-3 * self.touch.mean_n / self.stiffness.softest_n_mm

    @property
    def found_m(self) -> float:
        """Position of the motor at which the surface must have been touched [m]: a mean lags by its time."""
        behind_m = 1e-6 * self.touch.touch_speed_mm_s * self.touch.mean_ms
        return self.surface_m + 1e-3 * self.heights.tolerance_mm + self.touch_way_m + behind_m

    def press_plan(self, resolution_m: float, force: StreamSpec) -> PressPlan:
        """Return the numbers of a press by an axis with a least step [m], and with the stream of a force sensor."""
        touch, press = self.touch, self.press
        return PressPlan(
            law=self.force_loop.law((self.limits.travel_mm[0], 1e3 * self.deepest_m)),
            resolution_m=resolution_m,
            step_m=self.force_loop.step_m,
            near_m=self.surface_m - 1e-3 * self.heights.tolerance_mm,
            found_m=self.found_m,
            speed_m_s=1e-3 * touch.speed_mm_s,
            touch_speed_m_s=1e-3 * touch.touch_speed_mm_s,
            unload_speed_m_s=1e-3 * press.unload_speed_mm_s,
            mean_n=touch.mean_n,
            mean_count=samples(force, 1e-3 * touch.mean_ms),
            softest_n_m=1e3 * self.stiffness.softest_n_mm,
            stiffest_n_m=1e3 * self.stiffness.at_ceiling_n_mm,
            contact_n=touch.contact_n,
            settle_s=touch.settle_s,
            lift_m=1e-3 * touch.lift_mm,
            error_band_n=press.error_band_n,
        )


class ManipulatorFile(RigFile):
    """A rig file of this rig: errors in its settings name their line."""

    settings: RigSettings  # type: ignore[assignment]


def settings_of(file: RigFile) -> RigSettings:
    """Return the settings of a rig file; raises UsageError if one is wrong, or a device is missing."""
    found = read_options(RigSettings, file.settings, "the rig file's settings")
    missing = [name for name in axes_of(found) if name not in file.devices]
    if missing or file.force is None:
        raise UsageError(
            f"The rig file has no {', '.join([*missing, *(['force'] if file.force is None else [])])}.",
            hint="See docs/hardware.md for the devices of this rig.",
        )
    return found


def axes_of(settings: RigSettings) -> tuple[str, ...]:
    """Return the names of the axes, the pressing one first: it is homed and retracted before the others move."""
    return (MOTOR,) if settings.manipulator == "fixed" else (MOTOR, *JOINTS)


def positioner_of(registry: Any, name: str, entry: NamedDevice) -> tuple[type[Positioner], dict[str, Any]]:
    """Return the class of an axis, and its options; raises UsageError if it is none."""
    descriptor = registry.devices[entry.device]
    kind: Any = load_object(descriptor.driver)
    if not (isinstance(kind, type) and issubclass(kind, Positioner)):
        raise UsageError(
            f"The {name}, {entry.device}, is no Positioner.", hint="Its DeviceDescriptor's driver names the class."
        )
    return kind, {**(descriptor.emulated_options if entry.emulated else {}), **entry.options}


def with_limits(file: RigFile, registry: Any) -> tuple[RigFile, RigSettings]:
    """Return the file with the settings' limits among the motor's options, and its settings.

    Raises
    ------
    UsageError
        As :func:`settings_of`, and if the motor's options state a limit of their own.
    """
    settings, entry = settings_of(file), file.devices[MOTOR]
    limits = settings.limits
    own = {
        "lower_m": 1e-3 * limits.travel_mm[0],
        "upper_m": 1e-3 * limits.travel_mm[1],
        "retreat_m": 1e-3 * limits.retreat_mm,
        "retreat_speed_m_s": 1e-3 * limits.retreat_speed_mm_s,
        "speed_m_s": 1e-3 * settings.touch.speed_mm_s,
        "acceleration_m_s2": 1e-3 * settings.touch.acceleration_mm_s2,
    }
    kind, options = positioner_of(registry, MOTOR, entry)
    if "homing" in kind.options_kind.model_fields and options.get("homing", "here") == "here":
        own["home_m"] = own["retreat_m"]  # it stands at the place to which it retreats
    if twice := [name for name in own if name in entry.options]:
        raise UsageError(
            f"The motor's {', '.join(twice)} is stated among its options.",
            hint="State it once, under `settings: limits:` and `touch:`.",
        )
    read_options(kind.options_kind, {**options, **own}, entry.device)
    motor = entry.model_copy(update={"options": {**entry.options, **own}})
    return file.model_copy(update={"devices": {**file.devices, MOTOR: motor}}), settings

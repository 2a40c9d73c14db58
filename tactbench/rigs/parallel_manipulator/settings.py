"""Models of this rig's `settings:` in a rig file; a file without all limits is refused, so that nothing moves.

Plain numbers, with the unit in a setting's name, converted to SI here. Motor positions are positive into the skin.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from tactbench.plugin import StreamSpec, UsageError, load_object
from tactbench.plugin.devices import (
    ForceLaw,
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
"""Name of the entry for the pressing axis under `devices:`."""
JOINTS = ("joint-1", "joint-2", "joint-3")
"""Names of the entries for the manipulator's rails under `devices:`, in the order of its legs."""
BEATS = 3
"""Least number of control periods without a beat before the guard retreats (derived: rig practice is two to three)."""
LEAST_HEARTBEAT_S = 0.02
"""Least time limit for a beat [s]; shorter limits trip falsely, as sleeps end up to 9.4 ms late (measured)."""
WINDUP_S = 0.2
"""Time [s] whose product with the loop's speed is the largest lead of target over measured position (assumed)."""

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Range = tuple[float, float]


class SafetyLimits(Options):
    """Limits of force, time and travel that are enforced by the guard."""

    force_ceiling_n: Positive
    """Norm of the raw force in one sample at which the motor retreats while it presses."""
    travel_ceiling_n: Positive = 0.2
    """Norm of the raw force for a retreat while the manipulator moves, or any axis is homed or retracted: above noise
    and drift, well below a press (assumed)."""
    torque_ceiling_nm: Positive | None = None
    """Norm of the raw torque at which the motor retreats; None: torque is not limited."""
    rated_force_n: Positive
    """Largest load of the weakest part (skin, sensor, force sensor or cap) by its data sheet."""
    force_age_ms: Positive = 30.0
    """Largest age of a force sample: three sampling periods of the force sensor, and the delays of sender and
    host (assumed: 250 Hz or more, and an ordinary kernel)."""
    travel_mm: Range
    """Least and greatest position of the motor; the 0 of a Faulhaber drive must lie in between."""
    heartbeat_ms: Positive
    """Time without a beat (sign of life) of the rig after which the motor retreats."""
    retreat_mm: float
    """Position of the motor away from the skin, where it waits and to which it retreats."""
    retreat_speed_mm_s: Positive


class Stiffness(Options):
    """Stiffness of skin, cap and machine in series, N/mm; declared, since it cannot be computed beforehand."""

    softest_n_mm: Positive
    """Least stiffness of any skin and cap, from the first touch on: force per way between any two depths. The lower
    it is, the later a force sensor that does not respond is noticed; above a skin's own, presses on it are ended."""
    at_touch_n_mm: Positive
    """Greatest stiffness up to the largest permitted force of a first touch."""
    greatest_n_mm: Positive
    """Stiffness at the largest commanded force on the stiffest cap, where the force loop must be stable."""
    at_ceiling_n_mm: Positive
    """Stiffness at the force ceiling, where a late reaction adds force."""


class ForceControl(Options):
    """Settings of the force loop."""

    rate_hz: Positive
    """Control periods per second, each with a beat to the guard."""
    proportional_mm_n: NotNegative = 0.0
    integral_mm_n_s: Positive
    cutoff_hz: Positive | None
    """Cut-off frequency of the first-order low-pass on the regulated force; null: unfiltered."""
    delay_ms: NotNegative
    """Delay from a force sample to the drive's receipt of the command: line time, answers, a control period's phase."""
    motor_lag_ms: NotNegative
    """Lag of the motor: time constant of the drive's position loop."""
    speed_mm_s: Positive
    """Largest speed commanded by the loop: 2 to 5 times that of the ramp on the softest skin."""
    feed_forward_n_mm: Positive | None = None
    """Assumed stiffness for the ramp's feed-forward; null: no feed-forward."""

    @property
    def step_m(self) -> float:
        """Largest increment in a control period [m]."""
        return 1e-3 * self.speed_mm_s / self.rate_hz

    def law(self, travel_mm: Range) -> ForceLaw:
        """Return the control law within a travel of the motor [mm]."""
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


class Touch(Options):
    """Settings of the search for the surface; see :class:`PressPlan`."""

    speed_mm_s: Positive
    """Speed on the way to the expected surface, before it can be reached."""
    touch_speed_mm_s: Positive
    """Speed from there until the touch."""
    acceleration_mm_s2: Positive
    """Acceleration of starting and braking."""
    single_n: Positive
    """Force of a touch: two of three raw samples above it. It must be well above the force sensor's noise."""
    mean_n: Positive
    """Mean force of a touch: the mean of raw samples in the last `mean_ms` above it. Also the largest mean without
    contact: before the surface, after lifting off, and at the place of retreat."""
    mean_ms: Positive
    """Time of this mean: one control period or more; its noise falls with the square root of the time."""
    allowed_n: Positive
    """Largest acceptable force of a first touch."""
    contact_n: Positive
    """Force held after the touch until the position of the surface is known; also the least force on the ramp."""
    settle_s: Positive
    """Time for which `contact_n` is held."""
    lift_mm: Positive
    """Distance of the motor from the place of contact during the unloaded hold."""


class PressRules(Options):
    """Settings of the normal or early end of a press; see :class:`PressPlan`."""

    error_band_n: Positive
    """Largest difference of filtered force and setpoint; if exceeded for a second, the motor retreats."""
    unload_speed_mm_s: Positive
    """Speed of unloading after the scene's ramp."""
    check_n: Positive | None = 3.0
    """Push by hand, or weight, with which an operator loads the force sensor before the first press of a session: it
    must be read with the right sign, within a factor of 1.5. null: not checked, as noted in recordings."""
    stale_ms: Positive = 100.0
    """Longest time without a row of the sensor; after this time the motor retreats."""


class Heights(Options):
    """Expected height of the sensor's surface below the indenter.

    Heights are those of the manipulator's point for which the retracted indenter's tip is at the stated height.
    """

    surface_mm: float
    """Height of the manipulator at which the retracted indenter would touch; 0 for a fixed manipulator."""
    tolerance_mm: NotNegative
    """Largest distance of the surface from `surface_mm`: three times its spread, and differences of caps' lengths."""
    stand_off_mm: Positive
    """Distance of tip and expected surface before the motor approaches."""
    clearance_mm: Positive
    """Distance of tip and expected surface on sideways moves."""
    depth_mm: Positive
    """Greatest depth of the motor below the expected surface."""

    @property
    def stand_off_m(self) -> float:
        """Height of the manipulator while the motor presses [m]."""
        return 1e-3 * (self.surface_mm + self.stand_off_mm)

    @property
    def clearance_m(self) -> float:
        """Height of the manipulator on sideways moves [m]."""
        return 1e-3 * (self.surface_mm + self.clearance_mm)


class Places(Options):
    """Settings of the manipulator's place for a scene: nominal contact point of the sensor, and permitted offsets.

    The manipulator's x axis is the sensor's: state the legs' `azimuth_deg` from this axis.
    """

    x_mm: float = 0.0
    """Manipulator's x (next: y) with the indenter above the nominal contact point."""
    y_mm: float = 0.0
    reach_x_mm: Range = (0.0, 0.0)
    """Permitted offsets of scenes along the sensor; the whole rectangle is tested beforehand."""
    reach_s_mm: Range = (0.0, 0.0)
    """Permitted offsets along the sensor's arc, as if it were flat."""

    def place_m(self, x_mm: float, s_mm: float) -> tuple[float, float]:
        """Return the manipulator's x and y [m] for offsets on the sensor."""
        return 1e-3 * (self.x_mm + x_mm), 1e-3 * (self.y_mm + s_mm)

    def corners_m(self) -> list[tuple[float, float]]:
        """Return the manipulator's x and y [m] at the four corners of the reach, in turn."""
        (x0, x1), (s0, s1) = self.reach_x_mm, self.reach_s_mm
        return [self.place_m(*at) for at in ((x0, s0), (x1, s0), (x1, s1), (x0, s1))]


class RigSettings(Options):
    """All settings of this rig, besides its devices."""

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
    """File to which the guard's process appends one line for each event, even if the rig's own process has ended."""

    @model_validator(mode="after")
    def _together(self) -> Self:
        limits, loop, touch, heights = self.limits, self.force_loop, self.touch, self.heights
        stiffness, ceilings = dict(self.stiffness), (limits.travel_ceiling_n, limits.force_ceiling_n)
        least_ms = 1e3 * max(BEATS / loop.rate_hz, LEAST_HEARTBEAT_S)
        deepest_mm = limits.retreat_mm + heights.stand_off_mm + heights.depth_mm
        found_mm = 1e3 * (self.found_m - self.surface_m)
        for names, *numbers in (
            ("travel_ceiling_n, force_ceiling_n and rated_force_n", *ceilings, limits.rated_force_n),
            (", ".join(stiffness), *stiffness.values()),
            ("tolerance_mm and stand_off_mm", heights.tolerance_mm, heights.stand_off_mm),
            ("stand_off_mm and clearance_mm", heights.stand_off_mm, heights.clearance_mm),
            ("three control periods (20 ms at least) and heartbeat_ms", least_ms, limits.heartbeat_ms),
            ("a control period and mean_ms", 1e3 / loop.rate_hz, touch.mean_ms),
            ("contact_n and mean_n", touch.contact_n, touch.mean_n),
            ("single_n and force_ceiling_n", touch.single_n, limits.force_ceiling_n),
            ("touch_speed_mm_s and speed_mm_s", touch.touch_speed_mm_s, touch.speed_mm_s),
            ("lift_mm and stand_off_mm", touch.lift_mm, heights.stand_off_mm),
            ("retreat_mm + stand_off_mm + depth_mm, and the greatest travel_mm", deepest_mm, limits.travel_mm[1]),
            ("depth of the touch on the softest skin (mean_n/softest_n_mm) and depth_mm", found_mm, heights.depth_mm),
        ):
            if numbers != sorted(numbers):
                raise ValueError(f"{names} must rise in this order: {', '.join(f'{number:g}' for number in numbers)}")
        return self

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
        """Way into the softest skin until its mean force counts as touch [m]."""
        return 1e-3 * self.touch.mean_n / self.stiffness.softest_n_mm

    @property
    def found_m(self) -> float:
        """Position of the motor at which even the lowest, softest skin must have been touched [m]: a mean lags."""
        behind_m = 1e-6 * self.touch.touch_speed_mm_s * self.touch.mean_ms
        return self.surface_m + 1e-3 * self.heights.tolerance_mm + self.touch_way_m + behind_m

    def press_plan(self, resolution_m: float, force: StreamSpec) -> PressPlan:
        """Return the numbers of a press for an axis' smallest step [m] and the stream of a force sensor."""
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
    """Rig file of this rig; messages on errors in its settings give the line."""

    settings: RigSettings  # type: ignore[assignment]


def settings_of(file: RigFile) -> RigSettings:
    """Return the settings of a rig file; raises UsageError if a setting is wrong, or a device is missing."""
    found = read_options(RigSettings, file.settings, "the rig file's settings")
    missing = [name for name in axes_of(found) if name not in file.devices]
    if missing or file.force is None:
        raise UsageError(
            f"The rig file has no {', '.join([*missing, *(['force'] if file.force is None else [])])}.",
            hint="See docs/hardware.md for the devices of this rig.",
        )
    return found


def axes_of(settings: RigSettings) -> tuple[str, ...]:
    """Return the names of the axes, the pressing axis first, as it is homed and retracted before the others move."""
    return (MOTOR,) if settings.manipulator == "fixed" else (MOTOR, *JOINTS)


def axis_of(registry: Any, name: str, entry: NamedDevice) -> tuple[type[Positioner], Any]:
    """Return the class of an axis' driver, and its options; raises UsageError if it is not a Positioner."""
    descriptor = registry.devices[entry.device]
    kind: Any = load_object(descriptor.driver)
    if not (isinstance(kind, type) and issubclass(kind, Positioner)):
        raise UsageError(
            f"The {name}, {entry.device}, is no axis.", hint="Its DeviceDescriptor's driver must be a Positioner."
        )
    given = {**(descriptor.emulated_options if entry.emulated else {}), **entry.options}
    return kind, read_options(kind.options_kind, given, name)


def with_limits(file: RigFile, registry: Any) -> tuple[RigFile, RigSettings]:
    """Return the rig file with the limits of its settings added to the motor's options, and the settings.

    Raises UsageError as :func:`settings_of`, and if the motor's options state a limit again, or the limits are invalid.
    """
    settings, entry = settings_of(file), file.devices[MOTOR]
    limits, touch = settings.limits, settings.touch
    own = {
        "lower_m": 1e-3 * limits.travel_mm[0],
        "upper_m": 1e-3 * limits.travel_mm[1],
        "retreat_m": 1e-3 * limits.retreat_mm,
        "retreat_speed_m_s": 1e-3 * limits.retreat_speed_mm_s,
        "speed_m_s": 1e-3 * touch.speed_mm_s,
        "acceleration_m_s2": 1e-3 * touch.acceleration_mm_s2,
    }
    _, options = axis_of(registry, MOTOR, entry)
    if getattr(options, "homing", "") == "here":
        own["home_m"] = own["retreat_m"]  # it stands at the place to which it retreats
    if twice := [name for name in own if name in entry.options]:
        raise UsageError(
            f"The motor's {', '.join(twice)} is stated in its options.",
            hint="State it once, under `settings: limits:` and `touch:`.",
        )
    motor = entry.model_copy(update={"options": {**entry.options, **own}})
    axis_of(registry, MOTOR, motor)
    return file.model_copy(update={"devices": {**file.devices, MOTOR: motor}}), settings

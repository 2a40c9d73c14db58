"""What outlives a scene: the guard with all axes, homed once, and the emulated devices."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.plugin import RigError, UsageError
from tactbench.plugin.devices import (
    FORCE,
    Beat,
    CommandKind,
    DeviceSettings,
    Driver,
    EmulatedDevices,
    ForceEntry,
    Guard,
    GuardProcess,
    GuardState,
    Limits,
    LocalGuard,
    NamedDevice,
    Positioner,
    PressingForce,
    ProcessSettings,
    Report,
    RigFile,
    drivers_of,
    emulators_of,
    with_sensor,
)
from tactbench.rigs.parallel_manipulator.platform import NEAR_M, Platform
from tactbench.rigs.parallel_manipulator.settings import JOINTS, MOTOR, RigSettings, axes_of

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray
    from tactbench.plugin.devices import Clock, EmulatedDevice, Link
    from tactbench.rigs.parallel_manipulator.emulated_press import EmulatedPress


class Senses:
    """What emulated devices sense of the scene that is carried out; nothing between two scenes."""

    def __init__(self) -> None:
        self.press: EmulatedPress | None = None
        self.motor: Any = None
        """The emulated motor, with its `position_m` as its controller counts."""

    def __call__(self, t_s: float) -> Mapping[str, float]:
        """Return the value of every channel at a second of the devices' clock."""
        position_m = -math.inf if self.motor is None else self.motor.position_m
        return {} if self.press is None else self.press.sensed(t_s, position_m)

    def force_n(self, position_m: float) -> float:
        """Return the force of the skin [N] at a position of the motor [m]."""
        return 0.0 if self.press is None else self.press.force_n(position_m)


def coupled_emulators(
    file: RigFile, settings: RigSettings, registry: Any, sensors: Collection[str], senses: Senses
) -> dict[str, EmulatedDevice]:
    """Return the emulated devices of a rig with some of its sensors: the motor moves, `senses` answer."""
    found: dict[str, EmulatedDevice] = {}
    for sensor in sensors:
        own = emulators_of(with_sensor(file, sensor), registry, sensor, senses)
        found |= {name: device for name, device in own.items() if name not in found}
    for name in axes_of(settings):
        if name not in found:
            continue
        axis: Any = found[name].emulator
        if not hasattr(axis, "press_against"):
            raise UsageError(f"The emulated {name} is no axis.", hint="Its emulator lacks press_against.")
        # The platform's weight is not modelled.
        axis.press_against(senses.force_n if name == MOTOR else None)
        if name == MOTOR:
            senses.motor = axis
    return found


class Session:
    """Opens all devices but the sensor's, and keeps them until :meth:`close`.

    Axes are homed at the first scene, in the order of `axes_of`, and keep their home as long as drive and session live.

    Parameters
    ----------
    file
        With the motor's limits.
    settings
        Of the rig.
    registry
        Of the devices.
    sensors
        Whose emulators run in this session.

    Raises
    ------
    LinkError, RigError, UsageError
        If a link cannot be opened, or a device does not answer or is another.
    """

    def __init__(self, file: RigFile, settings: RigSettings, registry: Any, sensors: Collection[str]) -> None:
        self._file, self._settings, self._registry = file, settings, registry
        self.senses = Senses()
        self.virtual = file.emulated and file.emulation.time == "virtual"
        self._stack = ExitStack()
        with ExitStack() as opening:
            opening.callback(self._stack.close)
            emulators = coupled_emulators(file, settings, registry, sensors, self.senses) if file.emulated else {}
            self.emulated: EmulatedDevices | None = None
            self.clock: Clock = time.monotonic_ns
            if emulators:
                self.emulated = self._stack.enter_context(EmulatedDevices(emulators, time=file.emulation.time))
                self.clock = self.emulated.clock
            self._links: Mapping[str, Callable[[], Link]] = (
                {} if self.emulated is None else {name: partial(self.emulated.open_link, name) for name in emulators}
            )
            self.guard: Guard = self._guard(next(iter(sensors)))
            self.identity = self.guard.start()
            opening.pop_all()
        self.platform = Platform.of(settings)

    def close(self) -> None:
        """Disarm the guard and close all devices; axes hold where they are."""
        self._stack.close()

    def opened(self, sensor: str, *names: str) -> list[Driver]:
        """Open drivers of devices by name; the caller closes them."""
        file = with_sensor(self._file, sensor).checked_for_one_clock()
        drivers = drivers_of(file, self._registry, sensor, self._links, self.clock, names)
        return [drivers[name] for name in names]

    def _guard(self, sensor: str) -> Guard:
        """Return the guard of all axes and the force sensor; it is disarmed and closed with the session."""
        names = axes_of(self._settings)
        guard: LocalGuard | GuardProcess
        if self.virtual:
            assert self.emulated is not None
            *axes, force = self.opened(sensor, *names, FORCE)
            found = {name: axis for name, axis in zip(names, axes, strict=True) if isinstance(axis, Positioner)}
            guard = LocalGuard(found, force, self.clock, self.emulated.advance)
        else:
            guard = GuardProcess(
                ProcessSettings(
                    axes={name: self._device(name) for name in names},
                    force=self._device(FORCE),
                    log=str(Path(self._settings.guard_log).expanduser().resolve()),
                    clock_zero_ns=time.monotonic_ns() - self.clock(),
                )
            )
        self._stack.callback(guard.close)
        return guard

    def _device(self, name: str) -> DeviceSettings:
        """Return what the guard's process is told of a device."""
        entry = self._file.entries()[name]
        assert isinstance(entry, ForceEntry | NamedDevice)
        descriptor = self._registry.devices[entry.device]
        options = {**(descriptor.emulated_options if entry.emulated else {}), **entry.options}
        addresses = {} if self.emulated is None else self.emulated.addresses
        return DeviceSettings(driver=descriptor.driver, link=addresses.get(name, entry.link), options=options)

    # A scene's beginning ----------------------------------------------------------------------------------------------

    def measured_limits(self) -> tuple[PressingForce, dict[str, FloatArray], Limits]:
        """Take the force sensor's zero, nothing being armed; return it, and what the guard is to keep."""
        assert self._file.force is not None
        guard, settings, stream = self.guard, self._settings, self.guard.force_stream
        force = PressingForce(self._file.force, (stream,))
        since_ns = self.clock()
        guard.advance(since_ns + round(1e9 * self._file.force.zero_s))
        # Not what has waited since nobody took it.
        fresh = (block.rows(block.t_ns >= since_ns) for block in guard.force_blocks() if block.t_ns is not None)
        zero = force.zero(fresh)[stream.name]
        limits, touch, loop = settings.limits, settings.touch, settings.force_loop
        low, high = limits.travel_mm
        kept = Limits(
            force_ceiling_n=limits.force_ceiling_n,
            travel_ceiling_n=limits.travel_ceiling_n,
            torque_ceiling_nm=limits.torque_ceiling_nm,
            touch_n=touch.single_n,
            travel_m=(1e-3 * low, 1e-3 * high),
            step_m=loop.step_m,
            speed_m_s=1e-3 * max(touch.speed_mm_s, settings.press.unload_speed_mm_s),
            heartbeat_s=1e-3 * limits.heartbeat_ms,
            force_age_s=limits.force_age_s(stream.rate_hz),
            channel=force.column,
            sign=force.sign,
            zero=tuple(zero.tolist()),
        )
        return force, {stream.name: zero}, kept

    def travel(self, xy_m: tuple[float, float]) -> tuple[float, float, float] | None:
        """Home what is not homed, and move the platform above a place; return where it is then, None: it is fixed.

        The guard is armed meanwhile: it watches the force, with the ceiling of travel, and stops all rails.

        Raises
        ------
        RigError
            If the way is not permitted, the guard has stopped it, or the platform is not where it was sent.
        """
        _, _, limits = self.measured_limits()
        report = self.guard.arm(limits)
        if self.platform is None:
            self.guard.disarm()
            return None
        way = self.platform.way(self.platform.place_m(report.positions), xy_m)
        beats = 0

        def beat(report: Report, targets: Mapping[str, float] | None = None) -> Report:
            nonlocal beats
            beats += 1
            kind = CommandKind.TRAVEL if targets else CommandKind.NONE
            now_ns, number = self.clock(), report.force_sequence
            report = self.guard.beat(Beat(beats, now_ns, "travel", kind, force_sequence=number, targets=targets or {}))
            if report.state is not GuardState.ARMED or (report.reason and not report.early):
                said = report.trigger or report.reason
                raise RigError(f"The manipulator was stopped on its way: {said}.", hint="See what is in its way.")
            self.guard.advance(now_ns + round(1e9 * self._settings.force_loop.period_s))
            return report

        for targets in self.platform.targets(way):
            report = beat(report, targets)
            while report.early:
                report = beat(report, targets)
            while report.moving:
                report = beat(report)
        place = self.platform.place_m(self.guard.disarm().positions)
        off_m = float(np.linalg.norm(np.subtract(place, way[-1])))
        if not off_m <= NEAR_M:
            raise RigError(
                f"The platform is {1e3 * off_m:.3f} mm from where it was sent.",
                hint=f"Home {', '.join(JOINTS)}; check the geometry.",
            )
        return place

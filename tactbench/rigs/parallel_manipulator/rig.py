"""The rig: a linear motor on a parallel manipulator presses a sensor under force control, while both are read.

Real devices: force sensor and motor are held by a guard in a process of its own. Emulated in virtual time: all in one
process and one thread, a control period at a time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tactbench.plugin import (
    Acquisition,
    Block,
    NotApplicable,
    PlanEntry,
    PluginContractError,
    Rig,
    RigContext,
    RigError,
    Scalar,
    Scene,
    SensorDescriptor,
    StreamSpec,
    UsageError,
    load_registry,
)
from tactbench.plugin.devices import (
    FORCE,
    DeviceAcquisition,
    Driver,
    EmulatedDevices,
    Emulation,
    ForceEntry,
    NamedDevice,
    Operator,
    PressingForce,
    Reading,
    RigFile,
    StreamClock,
    StreamCounts,
    ask_operator,
    drivers_of,
    emulation_of,
    emulators_of,
    physics_of,
    with_sensor,
)
from tactbench.rigs.parallel_manipulator.control import STOP_S, Control, WatchedDriver
from tactbench.rigs.parallel_manipulator.emulated_press import EmulatedPress, quiet
from tactbench.rigs.parallel_manipulator.guard import LocalGuard
from tactbench.rigs.parallel_manipulator.guard_interface import Event, Guard, GuardState, Limits, Report
from tactbench.rigs.parallel_manipulator.guard_messages import DeviceSettings, ProcessSettings
from tactbench.rigs.parallel_manipulator.guard_process import GuardProcess
from tactbench.rigs.parallel_manipulator.joints import Joints
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver
from tactbench.rigs.parallel_manipulator.motor.emulator import MotorEmulator
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.options import read_options
from tactbench.rigs.parallel_manipulator.press import Course, Press
from tactbench.rigs.parallel_manipulator.rig_check import refuse
from tactbench.rigs.parallel_manipulator.settings import JOINTS, MOTOR, settings_of, with_limits

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray
    from tactbench.plugin.devices import Clock, EmulatedDevice

FORCE_AGE_S = 0.010
"""Added to three sampling periods of the force sensor: how old a sample may be."""
MOST_EVENTS = 40
"""That are written into a recording; further ones are counted."""


@dataclass
class PressAcquisition:
    """One scene under the rig: iterate it for blocks."""

    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    assumptions: Mapping[str, Scalar]
    about: Mapping[str, Scalar]
    clocks: Mapping[str, StreamClock]
    emulation: Emulation | None
    force: PressingForce = field(repr=False)
    zero: Mapping[str, FloatArray] = field(repr=False)
    control: Control = field(repr=False)
    reading: Reading = field(repr=False)
    blocks: Iterator[Block] = field(repr=False)
    """The sensor's, from before the scene on."""
    clock: Clock = field(repr=False)
    begin_ns: int
    duration_s: float
    retreat_s: float
    """A retreat takes at most."""
    gaps: Mapping[str, int]
    """By stream: rows that were missing before the scene."""
    rows: dict[str, int] = field(default_factory=dict)
    """By stream: rows of the scene."""
    said: list[Event] = field(default_factory=list)

    def __iter__(self) -> Iterator[Block]:
        """Yield blocks of sensor, force sensor and motor until the scene is over; then unload, and retreat."""
        began_s = time.perf_counter()
        press = self.control.press
        end_ns = self.begin_ns + round(1e9 * self.duration_s)
        for block in self.blocks:
            yield from self._within(chain((block,), self.control.blocks()), end_ns)
            if press.over or (self.clock() >= end_ns and self.reading.ended):
                break
        yield from self._within(self.control.blocks(), end_ns)
        self.said += self.control.events()
        spent_s = time.perf_counter() - began_s
        if self.emulation is not None and spent_s > 0:
            factor = 1e-9 * (self.clock() - self.begin_ns) / spent_s
            self.emulation = self.emulation.model_copy(update={"factor": factor})

    def _within(self, blocks: Iterator[Block], end_ns: int) -> Iterator[Block]:
        """Yield the rows that belong to the scene."""
        for block in blocks:
            assert block.t_ns is not None
            first, last = np.searchsorted(block.t_ns, (self.begin_ns, end_ns)).tolist()
            if last > first:
                self.rows[block.stream] = self.rows.get(block.stream, 0) + last - first
                yield self.force.turned(_rows(block, slice(first, last)), self.zero)

    def stop(self, why: str) -> str:
        """Let the motor retreat at once, and wait for it; return what is to be done where it is not out.

        It retreats already, so a second interrupt changes nothing.
        """
        waiting = True
        while waiting:
            with suppress(KeyboardInterrupt):
                self.control.retreat(why, self.retreat_s)
                waiting = False
        self.said += self.control.events()
        return self.control.press.not_out

    @property
    def drawn(self) -> Mapping[str, Scalar]:
        """What was drawn and achieved: place, touch, events."""
        press = self.control.press
        found: dict[str, Scalar] = {
            **self.about,
            "press state": str(press.state),
            "touch n": press.touch_n,
            "contact mm": 1e3 * press.contact_m,
            "late control periods": self.control.late,
        }
        for number, event in enumerate(self.said[:MOST_EVENTS], start=1):
            at_s = 1e-9 * (event.t_ns - self.begin_ns)
            found[f"event {number}"] = f"{at_s:.3f} s, {event.state}: {event.text}"
        if len(self.said) > MOST_EVENTS:
            found["events left out"] = len(self.said) - MOST_EVENTS
        for remark in press.remarks:
            found["remark press"] = remark
        return found

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """By stream of the sensor: what became of the scene's rows; those of before and after are not counted."""
        found = {}
        for name, one in self.reading.stream_counts.items():
            rows = self.rows.get(name, 0)
            found[name] = one.model_copy(
                update={
                    "received": rows + one.dropped + one.duplicates + one.late,
                    "written": rows,
                    "gaps": one.gaps - self.gaps[name],
                }
            )
        return found

    @property
    def counts(self) -> Mapping[str, int]:
        """What drivers and guard have counted."""
        guard = {f"{name}: {what}": n for name, counts in self.control.counts().items() for what, n in counts.items()}
        return {**self.reading.counts, **guard}

    @property
    def ended(self) -> str:
        """Why it ended before its time; empty: it did not."""
        press = self.control.press
        return "; ".join(filter(None, (press.ended, press.not_out))) or self.reading.ended


class ParallelManipulator:
    """Devices of a rig file, and what presses them together.

    Parameters
    ----------
    file
        Which devices, on which links, and the rig's settings.
    operator
        Who mounts the caps; not needed where all devices are emulated.
    physics
        The simulated rig that moves emulated devices; None: there are none.

    Raises
    ------
    UsageError
        If the settings lack something, or contradict each other. What `doctor` refuses is :func:`build`'s business.
    """

    def __init__(self, file: RigFile, operator: Operator | None, physics: Rig | None) -> None:
        self.settings = settings_of(file)
        self._registry = load_registry()
        self._file = with_limits(file, self.settings)
        self._operator, self._physics = operator, physics

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[DeviceAcquisition]:
        """Open the devices, go to the scene's place, find the surface, and wait just above it.

        Raises
        ------
        NotApplicable
            If the scene asks for more than a rise of the force from 0, or for a place out of the declared reach.
        RigError
            If a device is not what the rig file says, nobody is there to mount a cap, or the surface is not found.
        UsageError
            If the rig file has no entry for the sensor, or says something that a driver does not know.
        LinkError
            If a link cannot be opened, or a device does not answer.
        """
        settings, scene = self.settings, quiet(scene)
        file = with_sensor(self._file, sensor.name).checked_for_one_clock()
        xy_m, place = self._place(scene, seed)
        with ExitStack() as stack:
            senses = self._senses(stack, file, sensor, scene, seed)
            emulators = {} if senses is None else self._emulators(file, sensor, senses[1])
            emulated = stack.enter_context(EmulatedDevices(emulators, time=file.emulation.time)) if emulators else None
            clock: Clock = time.monotonic_ns if emulated is None else emulated.clock
            links = {} if emulated is None else {name: partial(emulated.open_link, name) for name in emulators}

            def opened(*names: str) -> list[Driver]:
                drivers = drivers_of(file, self._registry, sensor.name, links, clock, names)
                for driver in drivers.values():
                    stack.callback(driver.close)
                return [drivers[name] for name in names]

            virtual = emulated is not None and file.emulation.time == "virtual"
            guard = self._guard(stack, file, opened, clock, emulated)
            said = guard.start()
            own, force, zero, limits = self._limits(file, guard, clock)
            guard.arm(limits)
            joints = self._go_there(guard, opened, xy_m)
            self._prompt(file, sensor, scene)
            (driver,) = opened(sensor.name)
            watched = WatchedDriver(driver, clock)
            identity = {**said, sensor.name: watched.identify()}
            _, _, zero, limits = self._limits(file, guard, clock)
            press = Press(settings, self._course(scene), own.profile().position_unit.to("m"))
            control: Control | None = None

            def carry(until_ns: int) -> None:
                if control is not None:
                    control.carry(until_ns)

            reading = stack.enter_context(
                Reading({sensor.name: watched}, clock=clock, advance=carry if virtual else None)
            )
            control = Control(
                guard, limits, guard.arm(limits), press, watched, clock,
                period_s=settings.force_loop.period_s, stale_s=1e-3 * settings.press.stale_ms,
            )  # fmt: skip
            stack.callback(control.stop)
            if not virtual:
                control.start()
            blocks = reading.blocks(math.inf, lambda: press.over)  # a sensor that is silent sends no block to look at
            events = self._find_surface(control, blocks)
            gaps = {name: one.gaps for name, one in reading.stream_counts.items()}
            begin_ns = clock()
            if senses is not None:
                senses[1].start(1e-9 * begin_ns)
            press.begin(1e-9 * begin_ns)
            simulated = None if senses is None else senses[0]
            yield PressAcquisition(
                streams=watched.streams,
                reference=(*force.streams, guard.motor_stream),
                plan=() if simulated is None else simulated.plan,
                assumptions={} if simulated is None else simulated.assumptions,
                about={
                    **({} if simulated is None else simulated.drawn),
                    **{f"{name} {key}": value for name, about in identity.items() for key, value in about.items()},
                    **force.about(zero),
                    **place,
                    **({} if joints is None else {"platform mm": _millimetres(joints.measured_m())}),
                    **({} if senses is None else {"skin mm": 1e3 * senses[1].skin_m}),
                },
                clocks={},
                emulation=emulation_of(file, identity),
                force=force,
                zero=zero,
                control=control,
                reading=reading,
                blocks=blocks,
                clock=clock,
                begin_ns=begin_ns,
                duration_s=scene.profile.duration.to("s"),
                retreat_s=limits.retreat_s + STOP_S,
                gaps=gaps,
                said=events,
            )

    # Before the press -------------------------------------------------------------------------------------------------

    def _place(self, scene: Scene, seed: int) -> tuple[tuple[float, float], dict[str, Scalar]]:
        """Return the manipulator's x and y for a scene, scatter included, and what to record of them."""
        places = self.settings.places
        x_mm, s_mm = scene.placement.x.to("mm"), scene.placement.s.to("mm")
        for name, value, (low, high) in (("x", x_mm, places.reach_x_mm), ("s", s_mm, places.reach_s_mm)):
            if not low <= value <= high:
                raise NotApplicable(
                    f"The scene {scene.name!r} asks for {name} = {value:g} mm; the rig file's reach is {low:g} to "
                    f"{high:g} mm.",
                    hint="Widen `settings: places:`, or put the sensor elsewhere.",
                )
        radius, angle = np.random.default_rng([seed, *scene.name.encode()]).random(2)
        off = places.scatter_mm * math.sqrt(radius)  # even over the disc
        dx, ds = off * math.cos(math.tau * angle), off * math.sin(math.tau * angle)
        drawn: dict[str, Scalar] = {"place x mm": x_mm, "place s mm": s_mm}
        if places.scatter_mm:
            drawn |= {"scatter x mm": dx, "scatter s mm": ds}
        return places.place_m(x_mm + dx, s_mm + ds), drawn

    def _senses(
        self, stack: ExitStack, file: RigFile, sensor: SensorDescriptor, scene: Scene, seed: int
    ) -> tuple[Acquisition, EmulatedPress] | None:
        """Return the scene as the simulated rig carries it out, and what emulated devices sense of it."""
        if self._physics is None or not file.emulated:
            return None
        simulated: Any = stack.enter_context(self._physics.open(sensor, scene, seed=seed))
        if not hasattr(simulated, "press_curve"):
            raise PluginContractError(
                f"The simulated rig {file.emulation.physics!r} has no press curves.",
                hint="Its acquisition needs press_curve: see SimulatedPress in tactbench.plugin.simulation.",
            )
        heights, limits = self.settings.heights, self.settings.limits
        rng = np.random.default_rng([file.emulation.seed, seed, *b"skin", *scene.name.encode()])
        off_mm = heights.surface_spread_mm * rng.standard_normal() + heights.cap_tolerance_mm * rng.uniform(-1, 1)
        skin_m = self.settings.surface_m + 1e-3 * float(
            np.clip(off_mm, -heights.stand_off_mm / 2, heights.depth_mm / 2)
        )
        press = EmulatedPress(simulated, scene, skin_m=skin_m, largest_n=1.5 * limits.force_ceiling_n, rng=rng)
        return simulated, press

    def _emulators(self, file: RigFile, sensor: SensorDescriptor, senses: EmulatedPress) -> dict[str, EmulatedDevice]:
        found = emulators_of(file, self._registry, sensor.name, senses)
        if MOTOR in found:
            emulator = found[MOTOR].emulator
            if not isinstance(emulator, MotorEmulator):
                raise UsageError(f"The emulated {MOTOR} is no faulhaber device.", hint="This rig moves one.")
            senses.pressed_by(emulator.drive)
        for name in JOINTS:
            if name in found and isinstance(joint := found[name].emulator, MotorEmulator):
                joint.drive.servo.load = None  # the platform's weight is not modelled
        return found

    def _guard(
        self, stack: ExitStack, file: RigFile, opened: Any, clock: Clock, emulated: EmulatedDevices | None
    ) -> Guard:
        """Return the guard of motor and force sensor; it is disarmed and closed at the end."""
        guard: LocalGuard | GuardProcess
        if emulated is not None and file.emulation.time == "virtual":
            motor, force = opened(MOTOR, FORCE)
            if not isinstance(motor, FaulhaberDriver):
                raise UsageError(f"The {MOTOR} is no faulhaber device.", hint="This rig moves one.")
            guard = LocalGuard(motor, force, clock, emulated.advance)
        else:
            addresses = {} if emulated is None else emulated.addresses
            guard = GuardProcess(
                ProcessSettings(
                    motor=self._device(file, MOTOR, addresses),
                    force=self._device(file, FORCE, addresses),
                    log=str(Path(self.settings.guard_log).expanduser().resolve()),
                    clock_zero_ns=time.monotonic_ns() - clock(),
                )
            )
        stack.callback(guard.close)
        return guard

    def _device(self, file: RigFile, name: str, addresses: Mapping[str, str]) -> DeviceSettings:
        """Return what the guard's process is told of a device."""
        entry = file.entries()[name]
        assert isinstance(entry, ForceEntry | NamedDevice)
        descriptor = self._registry.devices[entry.device]
        options = {**(descriptor.emulated_options if entry.emulated else {}), **entry.options}
        return DeviceSettings(driver=descriptor.driver, link=addresses.get(name, entry.link), options=options)

    def _limits(
        self, file: RigFile, guard: Guard, clock: Clock
    ) -> tuple[FaulhaberOptions, PressingForce, dict[str, FloatArray], Limits]:
        """Take the force sensor's zero; return it, and what the guard is to keep."""
        assert file.force is not None
        settings, stream = self.settings, guard.force_stream
        force = PressingForce(file.force, (stream,))
        guard.force_blocks()  # of before
        guard.advance(clock() + round(1e9 * file.force.zero_s))
        zero = force.zero(guard.force_blocks())[stream.name]
        options = read_options(FaulhaberOptions, file.devices[MOTOR].options, "faulhaber")
        assert options.retreat_m is not None
        assert options.retreat_speed_m_s is not None
        limits, touch, loop = settings.limits, settings.touch, settings.force_loop
        low, high = limits.travel_mm
        return (
            options,
            force,
            {stream.name: zero},
            Limits(
                force_ceiling_n=limits.force_ceiling_n,
                torque_ceiling_nm=limits.torque_ceiling_nm,
                touch_n=touch.single_n,
                travel_m=(1e-3 * low, 1e-3 * high),
                step_m=loop.step_m,
                speed_m_s=1e-3 * max(touch.speed_mm_s, settings.press.unload_speed_mm_s),
                retreat_m=options.retreat_m,
                retreat_speed_m_s=options.retreat_speed_m_s,
                heartbeat_s=1e-3 * limits.heartbeat_ms,
                force_age_s=FORCE_AGE_S + 3 / (stream.rate_hz or 1000.0)
                if limits.force_age_ms is None
                else 1e-3 * limits.force_age_ms,
                channel=force.column,
                sign=force.sign,
                zero=tuple(zero.tolist()),
                homing_force_n=limits.homing_force_n,
            ),
        )

    def _go_there(self, guard: Guard, opened: Any, xy_m: tuple[float, float]) -> Joints | None:
        """Move the manipulator above the place, the motor being retracted; None: it is fixed."""
        if self.settings.manipulator == "fixed":
            guard.disarm()
            return None
        retracted = guard.disarm()
        joints = Joints(opened(*JOINTS), self.settings)
        joints.start()
        limits = self.settings.limits
        joints.go(joints.plan(xy_m), lambda: _is_at(retracted, 1e-3 * limits.retreat_mm))
        return joints

    def _prompt(self, file: RigFile, sensor: SensorDescriptor, scene: Scene) -> None:
        profile = scene.profile
        text = (
            f"{scene.name}: {sensor.spec.title}. Mount the {scene.indenter}, take your hands out, and say so. Then it "
            f"is pressed to {profile.largest_n:g} N within {profile.duration.to('s'):.0f} s; Ctrl-C retreats."
        )
        ask_operator(file, self._operator, "mount a cap", text)

    def _course(self, scene: Scene) -> Course:
        profile = scene.profile
        times, forces = profile.corners
        end_s = profile.duration.to("s")
        return Course(
            setpoint_n=lambda at_s: float(np.interp(at_s, times, forces)),
            slope_n_s=profile.end.to("N") / (end_s - profile.hold_s),
            ramp_s=profile.hold_s,
            end_s=end_s,
        )

    def _find_surface(self, control: Control, blocks: Iterator[Block]) -> list[Event]:
        """Let the press find the surface; return what happened meanwhile, whose rows nobody keeps."""
        press = control.press
        press.go()
        for _ in blocks:
            for _ in control.blocks():
                pass
            if press.ready or press.over:
                break
        events = list(control.events())
        if not press.ready:
            said = "; ".join(event.text for event in events if event.trigger is not None)
            raise RigError(
                f"The surface was not found: {press.ended or 'the sensor has ended'}{f' ({said})' if said else ''}.",
                hint="Look at the rig: sensor, cap, heights in the rig file.",
            )
        return events


def _rows(block: Block, rows: slice) -> Block:
    """Return some rows of a block."""
    from dataclasses import replace

    return replace(
        block,
        **{
            name: value[rows]
            for name in ("t_ns", "data", "quality", "sequence", "device_ns")
            if (value := getattr(block, name)) is not None
        },
    )


def _is_at(report: Report, position_m: float) -> bool:
    return report.state is GuardState.IDLE and not report.moving and abs(report.position_m - position_m) < 1e-4


def _millimetres(place_m: tuple[float, float, float]) -> str:
    return ", ".join(f"{1e3 * x:.4f}" for x in place_m)


def build(context: RigContext) -> ParallelManipulator:
    """Return the rig.

    Raises
    ------
    UsageError
        If there is no rig file, it lacks something, `doctor` refuses it, or it names a simulation that is none.
    """
    if context.rig_file is None:
        raise UsageError(
            "The rig 'parallel-manipulator' needs to know its devices and its limits.",
            hint="Name a rig file with --rig-file FILE; `tactbench doctor --rig-file FILE` says what it would do.",
        )
    refuse(context.rig_file)
    physics = physics_of(context.rig_file, load_registry())
    return ParallelManipulator(context.rig_file, context.operator, physics)

"""The rig: a linear motor on a parallel manipulator presses a sensor under force control, while devices are read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING
from weakref import finalize

import numpy as np

from tactbench.plugin import (
    Acquisition,
    Block,
    NotApplicable,
    PlanEntry,
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
    Control,
    Course,
    DeviceAcquisition,
    Event,
    GuardLostError,
    Operator,
    Press,
    PressingForce,
    Reading,
    RigFile,
    StreamCounts,
    ask_operator,
    physics_of,
    with_sensor,
)
from tactbench.rigs.parallel_manipulator.emulated_press import quiet
from tactbench.rigs.parallel_manipulator.rig_check import check
from tactbench.rigs.parallel_manipulator.session import Session
from tactbench.rigs.parallel_manipulator.settings import MOTOR, axis_of, with_limits

if TYPE_CHECKING:
    from tactbench.plugin.devices import Clock, ScenePhysics

STOP_S = 10.0
"""Time added to that of a retreat [s] (assumed: a control period, and the answer of a guard in another process)."""


@dataclass
class PressAcquisition:
    """Recording of one scene with the rig: iterate over it to get the blocks."""

    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    assumptions: Mapping[str, Scalar]
    about: Mapping[str, Scalar]
    """Facts about the scene known at its beginning."""
    force: PressingForce = field(repr=False)
    control: Control = field(repr=False)
    reading: Reading = field(repr=False)
    blocks: Iterator[Block] = field(repr=False)
    """Blocks of the sensor, beginning before the scene."""
    clock: Clock = field(repr=False)
    duration_s: float
    retreat_s: float
    """Longest time of a retreat [s]."""
    events: list[Event] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.begin_ns = self.clock()
        self._gaps_before = {name: one.gaps for name, one in self.reading.stream_counts.items()}
        self._rows: dict[str, int] = {}

    def __iter__(self) -> Iterator[Block]:
        """Yield blocks of sensor, force sensor and motor until the scene is over; then unload it and retreat."""
        end_ns = self.begin_ns + round(1e9 * self.duration_s)
        for block in self.blocks:
            yield from self._within((block, *self.control.blocks()), end_ns)
            if self.control.press.over or (self.clock() >= end_ns and self.reading.ended):
                break
        yield from self._within(self.control.blocks(), end_ns)
        self.events += self.control.events()

    def _within(self, blocks: Iterable[Block], end_ns: int) -> Iterator[Block]:
        for block in blocks:
            assert block.t_ns is not None
            first, last = np.searchsorted(block.t_ns, (self.begin_ns, end_ns)).tolist()
            if last > first:
                self._rows[block.stream] = self._rows.get(block.stream, 0) + last - first
                yield self.force.turned(block.rows(slice(first, last)))

    def stop(self, why: str) -> str:
        """Let the motor retreat at once, and wait for it; return an instruction for the operator if the retreat failed.

        A further interrupt does not stop the retreat.
        """
        while True:
            with suppress(KeyboardInterrupt):
                self.control.retreat(why, self.retreat_s)
                break
        self.events += self.control.events()
        return self.control.press.not_out

    @property
    def drawn(self) -> Mapping[str, Scalar]:
        """Facts about the scene, including those known at its end: place, touch, events."""
        press = self.control.press
        events = {
            f"event {number}": f"{1e-9 * (event.t_ns - self.begin_ns):.3f} s, {event.state}: {event.text}"
            for number, event in enumerate(self.events, start=1)
        }
        return {
            **self.about,
            "press state": str(press.state),
            "touch n": press.touch_n,
            "contact mm": 1e3 * press.contact_m,
            "late control periods": self.control.late,
            **events,
        }

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """Numbers of the scene's rows by stream of the sensor; rows before and after the scene are not counted."""
        found = {}
        for name, one in self.reading.stream_counts.items():
            rows = self._rows.get(name, 0)
            received, gaps = rows + one.dropped + one.duplicates + one.late, one.gaps - self._gaps_before[name]
            found[name] = one.model_copy(update={"received": received, "written": rows, "gaps": gaps})
        return found

    @property
    def counts(self) -> Mapping[str, int]:
        """Event counts of drivers and guard, by device and name."""
        guard = {f"{name}: {what}": n for name, counts in self.control.counts.items() for what, n in counts.items()}
        return {**self.reading.counts, **guard}

    @property
    def ended(self) -> str:
        """Reason for an early end of the scene; empty: no early end."""
        press = self.control.press
        return "; ".join(filter(None, (press.ended, press.not_out))) or self.reading.ended


class ParallelManipulator(Rig):
    """Devices of a rig file, and the control which presses a sensor with them.

    Guard and homes are kept between scenes: in real time the session with them begins with the first scene and ends
    with this object or an error. In virtual time each scene has its own session, so that a recording does not depend on
    earlier scenes. Raises UsageError if settings are missing or contradict each other.

    Parameters
    ----------
    file
        Rig file with devices, links and settings. Emulated devices are in virtual time; devices run by `tactbench
        emulate` in real time count as real here.
    operator
        Access to the person who mounts the caps; not needed if all devices are emulated.
    physics
        Simulation of the scenes for emulated devices.
    """

    def __init__(self, file: RigFile, operator: Operator | None, physics: ScenePhysics) -> None:
        self._file, self._operator, self._physics, self._registry = file, operator, physics, load_registry()
        self._session: Session | None = None
        limited, self.settings = with_limits(file, self._registry)
        kind, options = axis_of(self._registry, MOTOR, limited.devices[MOTOR])
        self._facts = kind.facts_of(options)

    def close(self) -> None:
        """End the session, if one is open: disarm the guard and close all devices."""
        if self._session is not None:
            self._session = None
            self._finish()

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[DeviceAcquisition]:
        """Move to the scene's place, open the sensor, find its surface, and wait just above it.

        Raises
        ------
        NotApplicable
            If the scene is not a ramp of the force from 0, or its place is outside the declared reach.
        RigError
            If a device is not as stated in the rig file, there is no operator to mount a cap, or no surface is found.
        UsageError
            If the rig file has no entry for the sensor, or has an option unknown to a driver.
        LinkError
            If a link cannot be opened, or a device does not answer.
        """
        scene, file = quiet(scene), with_sensor(self._file, sensor.name)
        xy_m = self._place_m(scene)
        try:
            with ExitStack() as stack:
                simulated = stack.enter_context(self._physics.open(sensor, scene, seed=seed))
                if self._session is None:
                    self._session = session = Session(file if file.emulated else self._file, self._registry)
                    # For a program that forgets this object, or ends.
                    self._finish = finalize(self, session.close)
                if self._session.emulators is not None:
                    self._session.emulators.prepare(simulated, sensor, scene, seed)
                yield self._pressing(stack, self._session, sensor, scene, simulated, xy_m)
        except BaseException:
            self.close()
            raise
        if file.emulated:
            self.close()

    def _place_m(self, scene: Scene) -> tuple[float, float]:
        places = self.settings.places
        x_mm, s_mm = scene.placement.x.to("mm"), scene.placement.s.to("mm")
        for name, value, (low, high) in (("x", x_mm, places.reach_x_mm), ("s", s_mm, places.reach_s_mm)):
            if not low <= value <= high:
                raise NotApplicable(
                    f"The scene {scene.name!r} has {name} = {value:g} mm; the rig file's reach is {low:g} to "
                    f"{high:g} mm.",
                    hint="Widen `settings: places:`, or move the sensor.",
                )
        return places.place_m(x_mm, s_mm)

    def _pressing(
        self,
        stack: ExitStack,
        session: Session,
        sensor: SensorDescriptor,
        scene: Scene,
        simulated: Acquisition,
        xy_m: tuple[float, float],
    ) -> PressAcquisition:
        """Return the scene's recording, ready to begin; `stack` closes the scene's own devices."""
        settings, guard, clock, profile = self.settings, session.guard, session.clock, scene.profile
        emulators, facts, placement = session.emulators, self._facts, scene.placement
        ask = partial(ask_operator, with_sensor(self._file, sensor.name), self._operator)
        platform_m = session.travel(xy_m, ask)
        duration_s = profile.duration.to("s")
        ask(
            "mount a cap",
            f"{scene.name}: {sensor.spec.title}. Mount the {scene.indenter}, take your hands out, and confirm. Then it "
            f"is pressed to {profile.largest_n:g} N within {duration_s:.0f} s; Ctrl-C retreats.",
        )
        (driver,) = session.opened(sensor.name, sensor.name)
        stack.callback(driver.close)
        identity = {**session.identity, sensor.name: driver.identify()}
        force, limits = session.measured_limits()
        press = Press(settings.press_plan(facts.resolution, guard.force_stream), _course(scene))
        control: Control  # made below: it counts the rows of the reading that it advances
        advance = None if emulators is None else lambda until_ns: control.carry(until_ns)
        reading = stack.enter_context(Reading({sensor.name: driver}, clock=clock, advance=advance))
        stack.callback(_disarm, session)
        control = Control(
            guard, limits, guard.arm(limits), press,
            lambda: sum(one.received for one in reading.stream_counts.values()), clock,
            period_s=1 / settings.force_loop.rate_hz, stale_s=1e-3 * settings.press.stale_ms,
        )  # fmt: skip
        stack.callback(control.stop)
        if emulators is None:
            control.start()
        blocks = reading.blocks(math.inf, lambda: press.over)  # a silent sensor yields no block
        events = _find_surface(control, blocks)
        about: dict[str, Scalar] = dict(simulated.drawn)
        about |= {f"{name} {key}": value for name, values in identity.items() for key, value in values.items()}
        about |= {
            **force.about(),
            "force chain": session.checked,
            "place x mm": placement.x.to("mm"),
            "place s mm": placement.s.to("mm"),
        }
        if platform_m is not None:
            about["platform mm"] = ", ".join(f"{1e3 * x:.4f}" for x in platform_m)
        if emulators is not None and emulators.press is not None:
            about["skin mm"] = 1e3 * emulators.press.skin_m
        found = PressAcquisition(
            streams=driver.streams,
            reference=(*force.streams, guard.motor_stream),
            plan=simulated.plan,
            assumptions=simulated.assumptions,
            about=about,
            force=force,
            control=control,
            reading=reading,
            blocks=blocks,
            clock=clock,
            duration_s=duration_s,
            retreat_s=facts.seconds(facts.limits[1] - facts.limits[0], facts.retreat_speed) + STOP_S,
            events=events,
        )
        if emulators is not None:
            emulators.begin(1e-9 * found.begin_ns)
        self._physics.begin()
        press.begin(1e-9 * found.begin_ns)
        return found


def _course(scene: Scene) -> Course:
    profile = scene.profile
    times, forces = profile.corners
    end_s = profile.duration.to("s")
    return Course(
        setpoint_n=lambda at_s: float(np.interp(at_s, times, forces)),
        slope_n_s=forces[-1] / (end_s - profile.hold_s),
        ramp_s=profile.hold_s,
        end_s=end_s,
    )


def _find_surface(control: Control, blocks: Iterator[Block]) -> list[Event]:
    """Let the press find the surface, dropping all rows received meanwhile; return the guard's events."""
    press = control.press
    for _ in blocks:
        for _ in control.blocks():
            pass
        if press.ready or press.over:
            break
    events = list(control.events())
    if not press.ready:
        reasons = [press.ended or "the sensor has ended", *(one.text for one in events if one.trigger is not None)]
        raise RigError(
            f"The surface was not found: {'; '.join(reasons)}.",
            hint="Check sensor, cap, and the heights in the rig file.",
        )
    return events


def _disarm(session: Session) -> None:
    """Disarm the guard; the loss of the guard's process is ignored, since it was reported with its retreat before."""
    with suppress(GuardLostError):
        session.guard.disarm()
    if session.emulators is not None:
        session.emulators.press = None


def build(context: RigContext) -> ParallelManipulator:
    """Build the rig `parallel-manipulator`.

    Raises UsageError if there is no rig file, if it is incomplete or refused by `doctor`, or if its `physics` is not a
    simulation.
    """
    if context.rig_file is None:
        raise UsageError(
            "The rig 'parallel-manipulator' needs a rig file with its devices and limits.",
            hint="Give one by --rig-file FILE; `tactbench doctor --rig-file FILE` shows the forces that it permits.",
        )
    file = context.rig_file
    if problems := check(file).problems:
        raise UsageError(
            f"The rig file is refused: {problems[0]}",
            hint="`tactbench doctor --rig-file FILE --seconds 0` lists all problems.",
        )
    return ParallelManipulator(file, context.operator, physics_of(file, load_registry()))

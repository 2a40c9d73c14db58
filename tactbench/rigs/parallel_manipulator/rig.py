"""The rig: a linear motor on a parallel manipulator presses a sensor under force control, while both are read.

Real devices: force sensor and axes are held by a guard in a process of its own. Emulated in virtual time: all in one
process and one thread, a control period at a time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import TYPE_CHECKING, Any
from weakref import finalize

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
    Control,
    Course,
    DeviceAcquisition,
    Emulation,
    Event,
    GuardLostError,
    Operator,
    Press,
    PressingForce,
    Reading,
    RigFile,
    StreamClock,
    StreamCounts,
    ask_operator,
    emulation_of,
    physics_of,
    read_options,
    with_sensor,
)
from tactbench.rigs.parallel_manipulator.emulated_press import EmulatedPress, quiet
from tactbench.rigs.parallel_manipulator.rig_check import refuse
from tactbench.rigs.parallel_manipulator.session import Session
from tactbench.rigs.parallel_manipulator.settings import MOTOR, positioner_of, settings_of, with_limits

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray
    from tactbench.plugin.devices import Clock

STOP_S = 10.0
"""Added to the time of a retreat (assumed: a control period, and what a guard in another process takes to answer)."""
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

    What outlives a scene (guard, homes, emulated devices) is kept in a session: that of :meth:`session`; else, by the
    clock, one that begins with the first scene and ends with this object, and in virtual time one for each scene, so
    that a recording does not depend on those before it. An error ends it; the next scene begins another one.

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
        self._file = with_limits(file, self.settings, self._registry)
        self._operator, self._physics = operator, physics
        self._session: Session | None = None
        self._kept = not (file.emulated and file.emulation.time == "virtual")
        kind, options = positioner_of(self._registry, MOTOR, self._file.devices[MOTOR])
        self._facts = kind.facts_of(read_options(kind.options_kind, options, MOTOR))

    @contextmanager
    def session(self) -> Iterator[None]:
        """Keep devices and homes for all scenes that are opened inside."""
        kept, self._kept = self._kept, True
        try:
            yield
        finally:
            self._kept = kept
            self._end_session()

    def _current_session(self, sensor: str) -> Session:
        if self._session is None:
            sensors: Collection[str] = self._file.sensors if self._kept else (sensor,)
            self._session = session = Session(self._file, self.settings, self._registry, sensors)
            # For a program that forgets this object, or ends.
            self._finish = finalize(self, session.close)
        return self._session

    def _end_session(self) -> None:
        if self._session is not None:
            self._session = None
            self._finish()

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[DeviceAcquisition]:
        """Go to the scene's place, open the sensor, find the surface, and wait just above it.

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
        scene = quiet(scene)
        with_sensor(self._file, sensor.name)
        place = self._place(scene, seed)
        try:
            with ExitStack() as stack:
                senses = self._senses(stack, sensor, scene, seed)
                yield self._opened(stack, self._current_session(sensor.name), sensor, scene, senses, place)
        except BaseException:
            self._end_session()
            raise
        if not self._kept:
            self._end_session()

    def _opened(
        self,
        stack: ExitStack,
        session: Session,
        sensor: SensorDescriptor,
        scene: Scene,
        senses: tuple[Acquisition, EmulatedPress] | None,
        place: tuple[tuple[float, float], dict[str, Scalar]],
    ) -> PressAcquisition:
        """Return the scene, ready to begin; `stack` closes what is its own."""
        settings, guard, clock = self.settings, session.guard, session.clock
        file, (xy_m, drawn) = with_sensor(self._file, sensor.name), place
        session.senses.press = None if senses is None else senses[1]
        guard.disarm()  # of the scene before, if that ended in a fault
        platform_m = session.travel(xy_m)
        self._prompt(file, sensor, scene)
        (driver,) = session.opened(sensor.name, sensor.name)
        stack.callback(driver.close)
        identity = {**session.identity, sensor.name: driver.identify()}
        force, zero, limits = session.measured_limits()
        press = Press(settings.press_plan(self._facts.resolution), self._course(scene))
        control: Control | None = None

        def carry(until_ns: int) -> None:
            if control is not None:
                control.carry(until_ns)

        reading = stack.enter_context(
            Reading({sensor.name: driver}, clock=clock, advance=carry if session.virtual else None)
        )
        stack.callback(_disarmed, session)
        control = Control(
            guard, limits, guard.arm(limits), press, lambda: _received(reading), clock,
            period_s=settings.force_loop.period_s, stale_s=1e-3 * settings.press.stale_ms,
        )  # fmt: skip
        stack.callback(control.stop)
        if not session.virtual:
            control.start()
        blocks = reading.blocks(math.inf, lambda: press.over)  # a sensor that is silent sends no block to look at
        events = self._find_surface(control, blocks)
        gaps = {name: one.gaps for name, one in reading.stream_counts.items()}
        begin_ns = clock()
        if senses is not None:
            senses[1].start(1e-9 * begin_ns)
        press.begin(1e-9 * begin_ns)
        simulated = None if senses is None else senses[0]
        return PressAcquisition(
            streams=driver.streams,
            reference=(*force.streams, guard.motor_stream),
            plan=() if simulated is None else simulated.plan,
            assumptions={} if simulated is None else simulated.assumptions,
            about={
                **({} if simulated is None else simulated.drawn),
                **{f"{name} {key}": value for name, about in identity.items() for key, value in about.items()},
                **force.about(zero),
                **drawn,
                **({} if platform_m is None else {"platform mm": ", ".join(f"{1e3 * x:.4f}" for x in platform_m)}),
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
            retreat_s=self._facts.seconds(self._facts.limits[1] - self._facts.limits[0], self._facts.retreat_speed)
            + STOP_S,
            gaps=gaps,
            said=events,
        )

    # Before the press -------------------------------------------------------------------------------------------------

    def _place(self, scene: Scene, seed: int) -> tuple[tuple[float, float], dict[str, Scalar]]:
        """Return the manipulator's x and y [m] for a scene, scatter included, and what to record of them."""
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
        self, stack: ExitStack, sensor: SensorDescriptor, scene: Scene, seed: int
    ) -> tuple[Acquisition, EmulatedPress] | None:
        """Return the scene as the simulated rig carries it out, and what emulated devices sense of it."""
        file = self._file
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
        return simulated, EmulatedPress(
            simulated, scene, skin_m=skin_m, largest_n=1.5 * limits.force_ceiling_n, rng=rng
        )

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
    return replace(
        block,
        **{
            name: value[rows]
            for name in ("t_ns", "data", "quality", "sequence", "device_ns")
            if (value := getattr(block, name)) is not None
        },
    )


def _received(reading: Reading) -> int:
    return sum(one.received for one in reading.stream_counts.values())


def _disarmed(session: Session) -> None:
    """Let the guard expect no more beats; one that is lost has said so, and has retreated."""
    with suppress(GuardLostError):
        session.guard.disarm()
    session.senses.press = None


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

"""The guard of a rig's axes: it carries out a rig's commands within limits, and retreats when anything is wrong.

It reads the force and all axes every millisecond, whatever moves. The table of docs/hardware.md, Safety, lists what
makes it retreat, and what it refuses. A retreat halts every axis that moves and sends the pressing axis to its place
away from the skin. For axes that do as they state, the guard guarantees:

- *Steps.* One increment is out at a time, and the next is sent only if a force sample that was taken after the end of
  the one before is below the ceiling, and differs in number and value from the sample before it. So the force never
  exceeds F_c + k (step + corridor) and the noise of one sample, at any baud rate and whichever program hangs (derived;
  k the largest stiffness at the ceiling F_c). If the line falls silent, the axis ends one increment.
- *Moves at a speed v*, of any axis: :func:`largest_force_n`.
- *A rig that hangs or dies*: the retreat begins within heartbeat_s + reaction.

It cannot guarantee: anything about people; the force where the force sensor reads plausible wrong values
(:mod:`.press` compares force and place); forces that the sensor does not feel, such as the platform against the frame;
a retreat or a halt of an axis whose controller does not answer, which ends its move by itself; a place, where a
controller lost steps.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import NoReturn

from tactbench.core.errors import LinkClosed, LinkError, LinkTimeout, LinkUnplugged, RigError, TactbenchError
from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import Driver, fault_text
from tactbench.devices.force_watch import MOST_BLOCKS, ForceWatch, Problem, samples
from tactbench.devices.guard_messages import (
    Beat,
    CommandKind,
    Event,
    GuardRefusesError,
    GuardState,
    Limits,
    Report,
    Trigger,
)
from tactbench.devices.positioner import Positioner, PositionerSilentError
from tactbench.links.link import Clock

FORCE = "force"
"""Name of the force sensor among the names of axes."""
LOOK_S = 1e-3
"""Longest wait for a force sample in one check of all devices [s]: its sampling period."""
ALIVE_S = 0.2
"""Time for which the force is monitored before anything moves [s] (assumed: 200 samples at 1 kHz)."""
AGAIN_S = 0.25
"""Time after which a retreat that has not begun is sent again [s] (assumed: above that of an answer at 9600 baud)."""
RETREAT_S = 1.0
"""Time added to the duration of a retreat, or of the force's mean after it, before it has failed [s] (assumed)."""
REFUSED = 3
"""Number of refused commands in a row after which the guard retreats (assumed)."""
MOVING, NO_SAMPLE = "an axis is moving", "no force sample has come since the last move"
"""Reasons why a command comes too early; such a command may be sent again, and does not count as refused."""


def largest_force_n(
    ceiling_n: float, stiffness_n_m: float, speed_m_s: float, acceleration_m_s2: float, reaction: float
) -> float:
    """Return F_c + k v t_r + k v^2/(2 a) [N], the largest force of a move that is stopped at a ceiling F_c (derived).

    With the touch threshold as F_c, it is that of a first touch. k: largest stiffness up to F_c; t_r: reaction time.
    """
    return ceiling_n + stiffness_n_m * speed_m_s * (reaction + speed_m_s / (2 * acceleration_m_s2))


class LocalGuard:
    """A guard of axes with open drivers, which runs in the process, and on the clock, of the caller.

    Parameters
    ----------
    axes
        Drivers by axis name, not yet started: the pressing axis first, the others in the order of homing. The guard
        closes them.
    force
        Driver of the force sensor, with one stream; not yet started, and closed by the guard.
    clock
        Clock of all devices.
    advance
        Function that waits until a time of the clock [ns]; used only if the force sensor's link is gone.
    on_event
        Function called with each event.
    interrupted
        Function called while axes are homed or retracted; if it returns true, the axes halt.
    kept
        File that exists from arming until the pressing axis is known to be clear of the sensor, and states why it may
        not be clear; the next guard reads this file at its start. None: no file.

    Attributes
    ----------
    force_blocks, motor_blocks, events
        Samples of the force sensor, states of the pressing axis, and events, until cleared by the rig. Force samples
        that are doubled or late are left out.
    """

    def __init__(
        self,
        axes: Mapping[str, Positioner],
        force: Driver,
        clock: Clock,
        advance: Callable[[int], None],
        *,
        on_event: Callable[[Event], None] = lambda event: None,
        interrupted: Callable[[], bool] = lambda: False,
        kept: Path | None = None,
    ) -> None:
        self.state = GuardState.IDLE
        self.trigger: Trigger | None = None
        self._axes = dict(axes)
        self._name, *others = axes
        self._press = axes[self._name]
        self._others = {name: axes[name] for name in others}
        self._force, self._clock, self._advance = force, clock, advance
        self._on_event, self._interrupted = on_event, interrupted
        self._watch = ForceWatch(self.force_stream)
        self._limits: Limits
        self.force_blocks, self.motor_blocks = self._watch.blocks, deque[Block](maxlen=MOST_BLOCKS)
        self.events: list[Event] = []
        self._kept = kept
        self._not_out = kept.read_text(encoding="utf-8") if kept is not None and kept.exists() else ""
        self._counts: Counter[str] = Counter()
        self._lost: set[str] = set()
        self._home_anew: set[str] = set()
        self._closed = False
        self._refused = self._beat_ns = 0
        self._end_sequence = -1
        self._into_skin = self._touched = False
        self._began_ns = self._sent_ns = self._there_ns = 0

    @property
    def force_stream(self) -> StreamSpec:
        """Stream of the force sensor."""
        (stream,) = self._force.streams
        return stream

    @property
    def motor_stream(self) -> StreamSpec:
        """Stream of the pressing axis: position, current, target."""
        (stream,) = self._press.streams
        return stream

    # Requests of a rig ------------------------------------------------------------------------------------------------

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Identify all devices, and let them sample; return their identities by device name."""
        found = {}
        for name, device in {**self._axes, FORCE: self._force}.items():
            try:
                found[name] = dict(device.identify())
                device.start()
            except TactbenchError as error:
                error.message = f"{name}: {error.message}"
                raise
        self._record(None, "started")
        return found

    def arm(self, limits: Limits) -> Report:
        """Check limits and force, home axes that are not homed, retract the pressing axis, and begin to expect beats.

        The first beat is due within `heartbeat_s`. Earlier samples are dropped.

        Raises
        ------
        GuardRefusesError
            If a condition for arming is not met; no axis has moved, or all moves have ended. The state is IDLE, or
            FAULT if force or an axis failed while homing.
        """
        self._check(limits)
        self._check_force(limits)
        try:
            self._store_reason(
                f"armed at {datetime.now().isoformat(' ', 'seconds')}, and not known to have retreated since"
            )
        except OSError as error:
            hint = "Free disk space, or name another file as `guard_log:` in the rig file."
            raise GuardRefusesError(
                f"The guard does not arm: {self._kept} cannot be written: {error}.", hint=hint
            ) from error
        self._not_out = ""
        for name, axis in self._axes.items():
            try:
                self._make_ready(name, axis, limits)
            except Exception as error:
                self._home_anew.add(name)
                if isinstance(error, GuardRefusesError):
                    raise
                raise GuardRefusesError(
                    f"{name} is not armed: {fault_text(error)}.", hint=getattr(error, "hint", "")
                ) from error
        self.state, self._limits = GuardState.ARMED, limits
        self._refused, self._touched = 0, False
        self._end_sequence = self._watch.received
        # The samples of a homing may be those of a minute: to send them would take the time of a beat.
        self.force_blocks.clear()
        self.motor_blocks.clear()
        self._beat_ns = self._clock()
        self._record(None, "armed")
        return self._report()

    def beat(self, beat: Beat) -> Report:
        """Process a beat of the rig: note its time, and carry out its command; return at once."""
        if self.state is GuardState.ARMED:
            self._counts["beats"] += 1
            self._check_beat(beat.t_ns)
            self._beat_ns = min(beat.t_ns, self._clock())
        self.look(0.0)
        # A problem that this look has found goes before the command.
        if self.state is not GuardState.ARMED:
            return self._report(f"the guard is in state {self.state}")
        reason = self._command(beat)
        if reason in (MOVING, NO_SAMPLE):
            self._counts["early"] += 1
        elif reason:
            self._counts["refused"] += 1
            self._refused += 1
            self._record(None, f"refused in {beat.state or 'no state'}: {reason}")
            if self._refused >= REFUSED:
                self.trip(Trigger.COMMANDS_REFUSED, f"{REFUSED} in a row, reason of the last: {reason}")
        elif beat.command is not CommandKind.NONE:
            self._refused = 0
        return self._report(reason)

    def advance(self, until_ns: int) -> None:
        """Check all devices repeatedly until the clock has reached `until_ns`."""
        while (left_ns := until_ns - self._clock()) > 0:
            self.look(min(LOOK_S, 1e-9 * left_ns))

    @property
    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Event counts of the drivers by device, and of the guard: ``beats``, ``early`` and ``refused`` commands.

        The force sensor's include ``duplicates`` and ``late`` samples, both dropped, and missing samples, ``gaps``.
        """
        force, order = Counter(self._force.counts), self._watch.order
        force.update(duplicates=order.duplicates, late=order.late, gaps=order.gaps)
        axes = {name: dict(axis.counts) for name, axis in self._axes.items()}
        return {FORCE: +force, **axes, "guard": dict(self._counts)}

    def disarm(self) -> Report:
        """Retreat, and expect no more heartbeats of the rig; this also clears a fault.

        `Report.not_out` stays until an operator has confirmed that the indenter is clear, also for the next guard.
        """
        self.trip(Trigger.COMMANDED, "disarmed")
        while self.state is GuardState.RETREATING:
            self.look(LOOK_S)
        if self.state is not GuardState.IDLE:
            self.state = GuardState.IDLE
            self._record(None, "disarmed")
        self.trigger = None
        return self._report()

    def close(self) -> None:
        """Disarm, and close all devices; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        try:
            self.disarm()
        finally:
            for device in (*self._axes.values(), self._force):
                with suppress(LinkError):
                    device.close()

    # Looking ----------------------------------------------------------------------------------------------------------

    def look(self, timeout_s: float) -> None:
        """Read all devices, waiting at most `timeout_s` for a force sample, and react to problems."""
        began_ns = self._clock()  # where this look itself is held up, a beat may wait that was not received yet
        limits = self._limits if self.state in (GuardState.ARMED, GuardState.RETREATING) else None
        problem = self._read_devices(timeout_s, limits, travelling=any(axis.moving for axis in self._others.values()))
        if limits is None:
            return
        if problem is not None:
            self.trip(*problem)
        self._check_beat(began_ns)
        touched = self._into_skin and self._press.moving and self._watch.touched(limits.touch_n)
        if self.state is GuardState.ARMED and touched:
            self._into_skin, self._touched = False, True
            self._halt(self._press)
            self._record(None, "touch: the axis holds")
        if self.state is GuardState.RETREATING:
            self._continue_retreat()

    @property
    def _retracted(self) -> bool:
        return self._press.homed and self._press.at(self._press.facts.retreat)

    @property
    def _unclear(self) -> str:
        """Reason why an operator has to confirm that the indenter is clear of the sensor; empty: no need."""
        unhomed = self._home_anew | {name for name, axis in self._axes.items() if not axis.homed}
        here = [name for name, axis in self._axes.items() if axis.facts.homes_here and name in unhomed]
        return self._not_out or (f"{', '.join(here)} takes its present place as home" if here else "")

    def _check_beat(self, now_ns: int) -> None:
        age_s, most_s = 1e-9 * (now_ns - self._beat_ns), self._limits.heartbeat_s
        if age_s > most_s:
            self.trip(Trigger.BEAT_OLD, f"no heartbeat for {1e3 * age_s:.1f} ms, limit {1e3 * most_s:.1f} ms")

    def _read_devices(self, timeout_s: float, limits: Limits | None, *, travelling: bool) -> Problem | None:
        """Read all devices; return the first problem, those of the force before those of axes."""
        problem = self._take_force(timeout_s, limits, travelling=travelling)
        problems = [problem, *(self._take_axis(name, axis, limits) for name, axis in self._axes.items())]
        return next(filter(None, problems), None)

    def _take_force(self, timeout_s: float, limits: Limits | None, *, travelling: bool = True) -> Problem | None:
        if FORCE in self._lost:
            self._advance(self._clock() + round(1e9 * timeout_s))
            return None if limits is None else (Trigger.FORCE_LOST, "the link of the force sensor is gone")
        watch = self._watch
        try:
            blocks = self._force.read(timeout_s)
        except Exception as error:
            self._lost.add(FORCE)
            return Trigger.FORCE_LOST, fault_text(error)
        problems = [watch.take(block, limits, travelling=travelling) for block in blocks]
        return next(filter(None, problems), None if limits is None else watch.old(self._clock(), limits))

    def _take_axis(self, name: str, axis: Positioner, limits: Limits | None) -> Problem | None:
        if name in self._lost:
            return Trigger.AXIS_LOST, f"{name}: its link is gone"
        was_moving = axis.moving
        try:
            blocks = axis.read(0.0)
        except Exception as error:
            text = f"{name}: {fault_text(error)}"
            if isinstance(error, LinkUnplugged | LinkClosed):
                self._lost.add(name)
                return Trigger.AXIS_LOST, text
            self._home_anew.add(name)
            silent = isinstance(error, PositionerSilentError | LinkTimeout)
            return Trigger.AXIS_SILENT if silent else Trigger.AXIS_FAULT, text
        if axis is self._press:
            self.motor_blocks += blocks
            if was_moving and not axis.moving:
                self._end_sequence = self._watch.received
                self._into_skin = False
        if limits is not None and axis.state is not None and axis.state.problem:
            return Trigger.AXIS_FAULT, f"{name}: the controller reports {axis.state.problem}"
        return None

    # Commands ---------------------------------------------------------------------------------------------------------

    def _command(self, beat: Beat) -> str:
        """Carry out the command in a heartbeat; return the reason if it is refused, else an empty text."""
        if beat.command is CommandKind.NONE:
            return ""
        if beat.command is CommandKind.RETREAT:
            self.trip(Trigger.COMMANDED, "commanded by the rig")
            return ""
        if beat.command is CommandKind.STOP:
            self._into_skin = False
            self._halt(*(axis for axis in self._axes.values() if axis.moving))
            return ""
        if beat.force_sequence > self._watch.received:
            return f"force sample {beat.force_sequence} has not been received"
        travels, press = beat.command is CommandKind.TRAVEL, self._press
        if reason := self._travel_reason(beat) if travels else self._press_reason(beat):
            return reason
        if any(axis.moving for axis in self._axes.values()):
            return MOVING
        if min(beat.force_sequence, self._watch.changed) <= self._end_sequence:
            return NO_SAMPLE
        self._into_skin = self._touched = False
        try:
            if travels:
                for name, target in beat.targets.items():
                    self._others[name].move_to(target)
            elif beat.command is CommandKind.STEP:
                press.move_by(beat.distance_m)
            else:
                self._into_skin = press.state is not None and beat.position_m > press.state.target
                press.move_to(beat.position_m, beat.speed_m_s)
        except Exception as error:  # of the axis' driver, whatever it is: the command was not carried out
            return fault_text(error)
        return ""

    def _travel_reason(self, beat: Beat) -> str:
        if not self._retracted or self._press.moving:
            return f"{self._name} is not retracted"
        for name, target in beat.targets.items():
            low, high = self._others[name].facts.limits if name in self._others else (math.nan, math.nan)
            if not low <= target <= high:
                return f"the target of {name} is outside its travel"
        return ""

    def _press_reason(self, beat: Beat) -> str:
        """Return the reason why the pressing axis may not move as commanded; empty if it may."""
        state, limits, force_n = self._press.state, self._limits, self._watch.force_n
        if state is None or math.isnan(state.target):
            return f"the target of {self._name} is not known"
        is_step, (low, high) = beat.command is CommandKind.STEP, limits.travel_m
        target_m = state.target + beat.distance_m if is_step else beat.position_m
        if not low <= target_m <= high:
            return f"the target {target_m:g} m is outside the travel {low:g} to {high:g} m"
        if is_step:
            resolution = self._press.facts.resolution
            too_long = not abs(beat.distance_m) < (round(limits.step_m / resolution) + 0.5) * resolution
            return f"a step of {beat.distance_m:g} m is too long" if too_long else ""
        if not 0.0 < beat.speed_m_s <= limits.speed_m_s * (1 + 1e-9):
            return f"a speed of {beat.speed_m_s:g} m/s is not above 0 and up to {limits.speed_m_s:g} m/s"
        if target_m > state.target and not force_n < limits.touch_n:
            return f"a move into the skin, already in contact at {force_n:.3f} N"
        return ""

    def _halt(self, *axes: Positioner) -> None:
        """Halt axes; retreat if a halt fails."""
        try:
            for axis in axes:
                axis.halt()
        except Exception as error:
            self.trip(Trigger.AXIS_FAULT, fault_text(error))

    # Retreat ----------------------------------------------------------------------------------------------------------

    def trip(self, trigger: Trigger, text: str) -> None:
        """Begin a retreat, if the guard is armed; the reason of a retreat under way is kept."""
        if self.state is not GuardState.ARMED:
            return
        self.state, self.trigger = GuardState.RETREATING, trigger
        self._into_skin = False
        self._began_ns = self._clock()
        self._send_retreat()
        self._record(trigger, text)

    def _send_retreat(self) -> None:
        self._sent_ns = self._clock()
        commands = {name: axis.halt for name, axis in self._others.items() if axis.moving}
        # An axis that has lost its home has no known way to its place of retreat.
        commands[self._name] = self._press.retreat if self._press.homed else self._press.halt
        for name, command in commands.items():
            if name in self._lost:
                continue
            try:
                command()
            except (LinkUnplugged, LinkClosed):
                self._lost.add(name)
            except Exception:  # it is sent again
                continue

    def _continue_retreat(self) -> None:
        """End a retreat that is complete (pressing axis out, others at rest) or has failed; send it again if needed.

        The pressing axis is out if it is at rest at its place of retreat and the mean force since then is near zero.
        """
        press, now_ns, limits = self._press, self._clock(), self._limits
        took = f"{1e-9 * (now_ns - self._began_ns):.3f} s"
        fresh = press.state is not None and press.state.t_ns > self._sent_ns
        # An axis that is lost while it moves ends its move unobserved.
        lost = sorted(name for name in self._lost - {FORCE} if name == self._name or self._axes[name].moving)
        there = not press.moving and self._retracted and fresh
        self._there_ns = (self._there_ns or now_ns) if there else 0
        force_n = self._watch.mean_n(self._there_ns, samples(self.force_stream, limits.clear_s)) if there else math.nan
        stand = not any(axis.moving and name not in self._lost for name, axis in self._others.items())
        if stand and lost and (there or self._name in lost):
            self._end(Trigger.AXIS_LOST, f"stand clear: {', '.join(lost)} completes its last move and holds there")
        elif stand and abs(force_n) < limits.clear_n:
            self._end(None, f"out after {took}")
        elif stand and there:
            if FORCE in self._lost or now_ns > self._there_ns + 1e9 * (limits.clear_s + RETREAT_S):
                where = f"at its place of retreat after {took}, and the force is {force_n:.2f} N"
                text = f"NOT KNOWN TO BE OUT: {where}: stand clear, and check what the indenter touches"
                self._end(Trigger.NOT_CLEAR, text)
        elif now_ns > self._began_ns + 1e9 * retreat_seconds(press):
            power = "left under power, since it may fall without power"
            if press.facts.holds_unpowered:
                with suppress(LinkError, RigError):
                    press.disable()
                    power = "power taken off"
            where = f"not out after {took}, last read at {press.position:g} m"
            self._end(Trigger.RETREAT_FAILED, f"RETREAT FAILED: {where}; {power}: stand clear")
        elif not press.moving and now_ns - self._sent_ns > 1e9 * AGAIN_S:
            self._send_retreat()

    def _end(self, failed: Trigger | None, text: str) -> None:
        ordinary = failed is None and self.trigger in (Trigger.COMMANDED, Trigger.TERMINATED)
        self.state = GuardState.RETREATED if ordinary else GuardState.FAULT
        if failed is not None:
            self._home_anew.update(self._lost, [self._name])
            self._not_out = text
        with suppress(OSError):  # the file then still contains that it was armed
            self._store_reason(self._not_out)
        self._record(failed, text)

    def _store_reason(self, text: str) -> None:
        """Store the reason why the pressing axis is not known to be out for the next guard; empty: it is out."""
        if self._kept is not None and text:
            self._kept.write_text(text, encoding="utf-8")
        elif self._kept is not None:
            self._kept.unlink(missing_ok=True)

    # Arming -----------------------------------------------------------------------------------------------------------

    def _check(self, limits: Limits) -> None:
        """Raise GuardRefusesError if state, limits or axes do not permit arming."""
        facts, (low, high), zeros = self._press.facts, limits.travel_m, len(limits.zero)
        endless = [name for name, axis in self._axes.items() if not all(map(math.isfinite, axis.facts.limits))]
        stated = (facts.retreat, facts.retreat_speed, facts.speed, facts.acceleration)
        for wrong, problem in (
            (self.state is not GuardState.IDLE, f"its state is {self.state}: disarm it first"),
            (endless, f"no ends of travel are stated for {', '.join(endless)}"),
            (
                not all(axis.facts.interruptible for axis in self._axes.values()),
                "moves of an axis cannot be interrupted",
            ),
            (
                not all(map(math.isfinite, stated)) or not facts.corridor > 0,
                f"{self._name} must state retreat, retreat speed, speed, acceleration and corridor",
            ),
            (not facts.limits[0] <= low < high <= facts.limits[1], "the limits' travel is beyond the axis' ends"),
            (not low <= facts.retreat < high, "the place of retreat is not within the travel, below its end"),
            (facts.corridor > limits.step_m, "the axis' corridor is longer than the largest step"),
            (
                zeros != len(self.force_stream.channels),
                f"the limits have {zeros} zeros, not one for each channel of the force",
            ),
            (self._lost, "a device is gone: close the guard and open a new one"),
            (not limits.confirmed and self._unclear, f"{self._unclear}; an operator must confirm that it is clear"),
        ):
            if wrong:
                raise GuardRefusesError(f"The guard does not arm: {problem}.", hint="See docs/hardware.md, Safety.")

    def _check_force(self, limits: Limits) -> None:
        """Monitor the unloaded force for `ALIVE_S`; raises GuardRefusesError if there is a problem."""
        before = -1
        while self._watch.received != before:  # samples that have waited since the last look
            before = self._watch.received
            self._take_force(0.0, None)
        problem: Problem | None = None
        until_ns = self._clock() + round(1e9 * ALIVE_S)
        # A first sample may be as far away as its age may be.
        self._take_force(limits.force_age_s, None)
        while problem is None and self._clock() < until_ns:
            problem = self._take_force(LOOK_S, limits)
            for name, axis in self._axes.items():
                self._take_axis(name, axis, None)
        if problem is not None:
            raise GuardRefusesError(
                f"The guard does not arm: {problem[0]}: {problem[1]}.",
                hint="Unload the force sensor, take its zero anew, and check its cable.",
            )

    def _make_ready(self, name: str, axis: Positioner, limits: Limits) -> None:
        """Home an axis if needed, while the force is monitored; enable it, and retract the pressing axis."""
        problem: Problem | None = None

        def stop() -> bool:
            nonlocal problem
            problem = problem or self._take_force(0.0, limits) or self._interruption()
            return problem is not None

        if name in self._home_anew or not (axis.homed or axis.find_home()):
            self._record(None, f"homing {name}")
            try:
                axis.home(stop)
            except Exception as error:
                self._homing_failed(name, *(problem or (Trigger.HOMING, fault_text(error))))
        axis.confirm()
        if not axis.enabled:
            axis.enable()
        self._home_anew.discard(name)
        if axis is self._press:
            self._retract(limits)

    def _retract(self, limits: Limits) -> None:
        press = self._press
        deadline_ns = self._clock() + round(1e9 * retreat_seconds(press))
        press.retreat()
        sent_ns = self._clock()
        while press.moving or not self._retracted or press.state is None or press.state.t_ns <= sent_ns:
            problem = self._read_devices(LOOK_S, limits, travelling=True) or self._interruption()
            if problem is None and self._clock() > deadline_ns:
                problem = Trigger.HOMING, "it did not reach its place of retreat in time"
            if problem is not None:
                self._homing_failed(self._name, *problem)

    def _interruption(self) -> Problem | None:
        return (Trigger.TERMINATED, "interrupted") if self._interrupted() else None

    def _homing_failed(self, name: str, trigger: Trigger, text: str) -> NoReturn:
        outcome = f"{name} is at rest after an interrupted homing or retraction"
        if not self._stands(name):
            outcome = f"{name} was halted while being homed or retracted, and is not known to be at rest: stand clear"
            self._not_out = outcome
        self.state, self.trigger = GuardState.FAULT, Trigger.HOMING
        self._record(Trigger.HOMING, f"{name}: {trigger}: {text}")
        hint = "Check what the indenter touches; then disarm, and arm again."
        raise GuardRefusesError(f"{outcome}: {trigger}: {text}", hint=hint)

    def _stands(self, name: str) -> bool:
        """Halt an axis repeatedly; return True if it then reports the same place for `AGAIN_S`."""
        axis, place = self._axes[name], math.nan
        since_ns = begin_ns = again_ns = self._clock()
        while self._clock() < begin_ns + 1e9 * RETREAT_S:
            if self._clock() >= again_ns:
                again_ns += round(1e9 * AGAIN_S)
                with suppress(Exception):
                    axis.halt()
            self._take_force(LOOK_S, None)
            self._take_axis(name, axis, None)
            if not abs(axis.position - place) <= axis.facts.resolution:
                since_ns, place = self._clock(), axis.position
            elif axis.state is not None and axis.state.t_ns > since_ns + 1e9 * AGAIN_S:
                return True
        return False

    # Events and reports -----------------------------------------------------------------------------------------------

    def _record(self, trigger: Trigger | None, text: str) -> None:
        event = Event(self._clock(), self.state, trigger, self._watch.force_n, self._press.position, text)
        self.events.append(event)
        self._on_event(event)

    def _report(self, reason: str = "") -> Report:
        watch, state = self._watch, self._press.state
        return Report(
            t_ns=self._clock(),
            state=self.state,
            reason=reason,
            early=reason in (MOVING, NO_SAMPLE),
            moving=any(axis.moving for axis in self._axes.values()),
            position_m=self._press.position,
            target_m=math.nan if state is None else state.target,
            positions={name: axis.position for name, axis in self._axes.items()},
            force_n=watch.force_n,
            force_sequence=watch.received,
            touched=self._touched,
            trigger=self.trigger,
            not_out=self._not_out,
            unclear=self._unclear,
        )


def retreat_seconds(press: Positioner) -> float:
    """Return the longest time of a retreat [s], from the far end of the travel."""
    low, high = press.facts.limits
    return (high - low) / press.facts.retreat_speed + RETREAT_S

"""The guard of a rig's axes: carries out a rig's commands within limits, and retreats when anything is wrong.

It looks at the force and all axes every millisecond, whatever moves. What makes it retreat, and what it refuses, is the
table of docs/hardware.md, Safety. A retreat halts every axis that moves and sends the pressing axis to its place away
from the skin. What it promises, of axes that do as they state:

- *Steps.* One increment is out at a time, and the next is sent only if a force sample that was taken after the end of
  the one before is below the ceiling, and is another one in number and value than the sample before it. So the force
  never exceeds F_c + k (step + corridor) and the noise of one sample, whatever the line's rate and whoever hangs
  (derived; k the largest stiffness at the ceiling F_c). A line that falls silent lets the axis end one increment.
- *Moves at a speed v*, of any axis: :func:`largest_force_n`.
- *A rig that hangs or dies* makes the retreat begin within heartbeat_s + reaction.

What it cannot promise: anything about people; a force sensor that lies plausibly (a wrong zero, a broken channel that
still has noise); forces that the sensor does not feel, such as the platform against the frame; a retreat or a halt of
an axis whose controller does not answer, which ends its move by itself; a place, where a controller lost steps.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import NoReturn

from tactbench.core.errors import (
    LinkClosed,
    LinkError,
    LinkTimeout,
    LinkUnplugged,
    RigError,
    TactbenchError,
)
from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import Driver
from tactbench.devices.force_watch import ForceWatch, Problem
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
from tactbench.devices.positioner import Positioner, PositionerSilentError, power_off
from tactbench.devices.sequence import SequenceCheck
from tactbench.links.link import Clock

LOOK_S = 1e-3
"""Longest wait between two looks: the sampling period of the force."""
SCHEDULING_S = 6e-3
"""By which an ordinary kernel lets a process wait (a measured 99.9th percentile)."""
ALIVE_S = 0.2
"""For so long the force is watched before anything moves (assumed: 200 samples at 1 kHz)."""
AGAIN_S = 0.25
"""After which a retreat that is not under way is sent again (assumed: above the time of an answer at 9600 baud)."""
RETREAT_S = 1.0
"""Added to the way's time, after which a retreat has failed (assumed)."""
REFUSED = 3
"""Refused commands in a row that end the rig's command (assumed)."""


def reaction_s(axis: Positioner, force_age_s: float = LOOK_S) -> float:
    """Return the time from a force to the braking of an axis: age of the force, one look, scheduling, the axis' own."""
    return force_age_s + LOOK_S + SCHEDULING_S + axis.facts.stop_latency_s


def largest_force_n(
    ceiling_n: float, stiffness_n_m: float, speed_m_s: float, acceleration_m_s2: float, reaction: float
) -> float:
    """Return F_c + k v t_r + k v^2/(2 a) [N]: what a move may come to that is stopped at a ceiling (derived).

    With a threshold of touch for F_c it is the largest force of a first touch. k is the largest stiffness up to there.
    """
    return ceiling_n + stiffness_n_m * speed_m_s * (reaction + speed_m_s / (2 * acceleration_m_s2))


class LocalGuard:
    """A guard over open drivers, in the process and the time of the caller.

    Parameters
    ----------
    axes
        By name, the pressing axis first, the others in the order in which they are homed; not started, closed with the
        guard.
    force
        The force sensor, with one stream; likewise.
    clock
        That of all.
    advance
        Lets time pass until a nanosecond of the clock; used only where no device's link can be waited for.
    on_event
        Called with each event.
    interrupted
        Called while axes are homed: whether they shall stand.
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
    ) -> None:
        self.state = GuardState.IDLE
        self.trigger: Trigger | None = None
        self._axes = dict(axes)
        self._name = next(iter(axes))
        self._press = axes[self._name]
        self._others = {name: axis for name, axis in axes.items() if name != self._name}
        self._force, self._clock, self._advance = force, clock, advance
        self._on_event, self._interrupted = on_event, interrupted
        self._watch: ForceWatch | None = None
        self._order = SequenceCheck()
        self._limits: Limits | None = None
        self._force_blocks: list[Block] = []
        self._motor_blocks: list[Block] = []
        self._events: list[Event] = []
        self._not_out = ""
        self._counts: Counter[str] = Counter()
        self._lost: set[str] = set()
        self._home_anew: set[str] = set()
        self._force_lost = self._closed = False
        self._beats = self._refused = 0
        self._beat_ns = 0
        self._end_sequence = -1
        self._into_skin = self._touched = False
        self._began_ns = self._sent_ns = 0

    # What a rig asks for ----------------------------------------------------------------------------------------------

    @property
    def force_stream(self) -> StreamSpec:
        """The force sensor's stream."""
        (stream,) = self._force.streams
        return stream

    @property
    def motor_stream(self) -> StreamSpec:
        """The pressing axis' stream."""
        (stream,) = self._press.streams
        return stream

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Ask all devices who they are, and let them sample."""
        if len(self._force.streams) != 1:
            raise RigError("The guard needs a force sensor with one stream.")
        found = {}
        for name, device in {**self._axes, "force": self._force}.items():
            with _named(name):
                found[name] = dict(device.identify())
                device.start()
        self._watch = ForceWatch(self.force_stream)
        self._tell(None, "started")
        return found

    def arm(self, limits: Limits) -> Report:
        """Check, home what is not homed, retract the pressing axis, and begin to expect beats.

        The first beat is due within `heartbeat_s`, and its sequence is 1.

        Raises
        ------
        GuardRefusesError
            If something is not as it must be; nothing was moved, or what was begun has ended. The state is IDLE, or
            FAULT if force or an axis went wrong while homing.
        """
        if self.state is not GuardState.IDLE:
            raise GuardRefusesError(f"The guard is in state {self.state}.", hint="Disarm it first.")
        self._check(limits)
        self._wait_for_force(limits)
        for name, axis in self._axes.items():
            try:
                self._make_ready(name, axis, limits)
            except (RigError, LinkError) as error:
                self._home_anew.add(name)
                if isinstance(error, GuardRefusesError):
                    raise
                raise GuardRefusesError(f"{name} is not armed: {error.message}", hint=error.hint) from error
        self.state, self._limits = GuardState.ARMED, limits
        self._beats, self._refused, self._touched = 0, 0, False
        self._end_sequence = self._seen_force.sequence
        self._beat_ns = self._clock()
        self._tell(None, "armed")
        return self._report(0)

    def beat(self, beat: Beat) -> Report:
        """Say that the rig is there, and what shall be done; return at once."""
        limits = self._limits
        if self.state is GuardState.ARMED and limits is not None:
            self._counts["beats"] += 1
            if beat.sequence != self._beats + 1:
                expected = self._beats + 1
                self._retreat(Trigger.BEAT_SEQUENCE, f"beat {beat.sequence} came, {expected} was expected")
            elif beat.t_ns - self._beat_ns > 1e9 * limits.heartbeat_s:
                self._retreat(*self._late(beat.t_ns, limits))
            self._beats, self._beat_ns = beat.sequence, min(beat.t_ns, self._clock())
        self.look(0.0)
        # What this look has found stands before the command.
        if self.state is not GuardState.ARMED or limits is None:
            return self._report(beat.sequence, f"the guard is in state {self.state}")
        reason, early = self._command(beat, limits)
        if early:
            self._counts["early"] += 1
        elif reason:
            self._counts["refused"] += 1
            self._refused += 1
            self._tell(None, f"refused in {beat.state or 'no state'}: {reason}")
            if self._refused >= REFUSED:
                self._retreat(Trigger.COMMANDS_REFUSED, f"{REFUSED} in a row, the last because {reason}")
        elif beat.command is not CommandKind.NONE:
            self._refused = 0
        return self._report(beat.sequence, reason, early=early)

    def advance(self, until_ns: int) -> None:
        """Look until the clock says so much."""
        while (left_ns := until_ns - self._clock()) > 0:
            self.look(min(LOOK_S, 1e-9 * left_ns))

    def force_blocks(self) -> list[Block]:
        """Return all force samples since the last call, but for those that came twice or after newer ones."""
        found, self._force_blocks = self._force_blocks, []
        return found

    def motor_blocks(self) -> list[Block]:
        """Return all states of the pressing axis since the last call."""
        found, self._motor_blocks = self._motor_blocks, []
        return found

    def events(self) -> list[Event]:
        """Return what has happened since the last call."""
        found, self._events = self._events, []
        return found

    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Return the drivers' counts, and the guard's ``beats``, ``early``, ``refused``, ``retreats_sent``.

        To the force sensor's the guard adds ``duplicates`` and ``late`` samples, kept out, and ``gaps``, missing.
        """
        order = self._order
        kept_out = {"duplicates": order.duplicates, "late": order.late, "gaps": order.gaps}
        force = {**self._force.counts, **{name: count for name, count in kept_out.items() if count}}
        axes = {name: dict(axis.counts) for name, axis in self._axes.items()}
        return {"force": force, **axes, "guard": dict(self._counts)}

    def disarm(self) -> Report:
        """Retreat if the pressing axis is not at its place, and expect no more beats; a fault is cleared."""
        if self.state is GuardState.ARMED and (self._moving or not self._retracted):
            self._retreat(Trigger.COMMANDED, "disarmed")
        while self.state is GuardState.RETREATING:
            self.look(LOOK_S)
        if self.state is not GuardState.IDLE:
            self.state = GuardState.IDLE
            self._tell(None, "disarmed")
        self._limits, self.trigger = None, None
        report, self._not_out = self._report(0), ""
        return report

    def abandon(self) -> None:
        """Close the axes' links and send nothing more: before :meth:`Positioner.rescue` by others."""
        for name, axis in self._axes.items():
            axis.close()
            self._lost.add(name)
        self.state = GuardState.FAULT

    def close(self) -> None:
        """Disarm, and close all devices; once closed, this does nothing."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._watch is not None:  # else it was not started: there is nothing to disarm
                self.disarm()
        finally:
            for device in (*self._axes.values(), self._force):
                with suppress(LinkError):
                    device.close()

    # Looking ----------------------------------------------------------------------------------------------------------

    def look(self, timeout_s: float) -> None:
        """Take what has come, waiting at most so long for a force sample, and act on it."""
        began_ns = self._clock()  # where this look itself is held up, a beat may wait that nobody has heard yet
        watched = self._limits if self.state in (GuardState.ARMED, GuardState.RETREATING) else None
        problem = self._seen(timeout_s, watched, travelling=any(axis.moving for axis in self._others.values()))
        limits = self._limits
        if limits is None:
            return
        if self.state is GuardState.ARMED:
            late = began_ns - self._beat_ns > 1e9 * limits.heartbeat_s
            problem = problem or (self._late(began_ns, limits) if late else None)
            if problem is not None:
                self._retreat(*problem)
            elif self._into_skin and self._press.moving and self._seen_force.touched(limits.touch_n):
                self._into_skin, self._touched = False, True
                self._halt(self._press)
                self._tell(None, "touch: the axis holds")
        if self.state is GuardState.RETREATING:
            self._carry_on()

    def trip(self, trigger: Trigger, text: str) -> None:
        """Retreat for a reason from outside; nothing if the guard is not armed."""
        if self.state is GuardState.ARMED:
            self._retreat(trigger, text)

    @property
    def _seen_force(self) -> ForceWatch:
        if self._watch is None:
            raise GuardRefusesError("The guard was not started.", hint="Use start().")
        return self._watch

    @property
    def _moving(self) -> bool:
        return any(axis.moving for axis in self._axes.values())

    @property
    def _retracted(self) -> bool:
        return self._press.at(self._press.facts.retreat)

    def _late(self, now_ns: int, limits: Limits) -> Problem:
        age_s = 1e-9 * (now_ns - self._beat_ns)
        return Trigger.BEAT_OLD, f"no beat for {1e3 * age_s:.1f} ms, {1e3 * limits.heartbeat_s:.1f} may be"

    def _seen(self, timeout_s: float, limits: Limits | None, *, travelling: bool) -> Problem | None:
        """Take what all devices have sent; return the first thing that is wrong, of the force first."""
        problem = self._take_force(timeout_s, limits, travelling=travelling)
        wait_s = timeout_s if self._force_lost else 0.0
        if wait_s and self._name in self._lost:
            self._advance(self._clock() + round(1e9 * wait_s))
            wait_s = 0.0
        for name, axis in self._axes.items():
            found = self._take_axis(name, axis, wait_s if axis is self._press else 0.0, limits)
            problem = problem or found
        return problem

    def _take_force(self, timeout_s: float, limits: Limits | None, *, travelling: bool = True) -> Problem | None:
        watch, problem = self._seen_force, None
        if self._force_lost:
            return None if limits is None else (Trigger.FORCE_LOST, "the force sensor is gone")
        try:
            blocks = self._force.read(timeout_s)
        except (LinkError, RigError) as error:
            self._force_lost = True
            return Trigger.FORCE_LOST, error.message
        for block in blocks:
            newer = self._order(block)
            if newer is not None:
                self._force_blocks.append(newer)
            found = watch.take(block, newer, limits, travelling=travelling)
            problem = problem or found
        return problem or (None if limits is None else watch.old(self._clock(), limits))

    def _take_axis(self, name: str, axis: Positioner, timeout_s: float, limits: Limits | None) -> Problem | None:
        if name in self._lost:
            return Trigger.AXIS_LOST, f"{name}: its link is gone"
        was_moving = axis.moving
        try:
            blocks = axis.read(timeout_s)
        except (LinkUnplugged, LinkClosed) as error:
            self._lost.add(name)
            return Trigger.AXIS_LOST, f"{name}: {error.message}"
        except (PositionerSilentError, LinkTimeout) as error:
            self._home_anew.add(name)
            return Trigger.AXIS_SILENT, f"{name}: {error.message}"
        except RigError as error:
            self._home_anew.add(name)
            return Trigger.AXIS_FAULT, f"{name}: {error.message}"
        if axis is self._press:
            self._motor_blocks += blocks
            if was_moving and not axis.moving:
                self._end_sequence = self._seen_force.sequence
                self._into_skin = False
        if limits is not None and axis.state is not None and axis.state.problem:
            return Trigger.AXIS_FAULT, f"{name}: the controller says {axis.state.problem}"
        return None

    # Commands ---------------------------------------------------------------------------------------------------------

    def _command(self, beat: Beat, limits: Limits) -> tuple[str, bool]:
        """Carry out what a beat asks for; else return why not, and whether it only is too early."""
        match beat.command:
            case CommandKind.NONE:
                return "", False
            case CommandKind.RETREAT:
                self._retreat(Trigger.COMMANDED, "the rig has commanded it")
                return "", False
            case CommandKind.STOP:
                self._into_skin = False
                for axis in self._axes.values():
                    if axis.moving:
                        self._halt(axis)
                return "", False
        if beat.force_sequence > self._seen_force.sequence:
            return f"force sample {beat.force_sequence} has not come", False
        reason = self._travel_reason(beat) if beat.command is CommandKind.TRAVEL else self._press_reason(beat, limits)
        if reason:
            return reason, False
        if self._moving:
            return "an axis is moving", True
        if min(beat.force_sequence, self._seen_force.changed) <= self._end_sequence:
            return "no force sample is known from after the last move", True
        press = self._press
        before = press.state
        try:
            if beat.command is CommandKind.TRAVEL:
                for name, target in beat.targets.items():
                    self._others[name].move_to(target)
            elif beat.command is CommandKind.STEP:
                press.move_by(beat.distance_m)
            else:
                press.move_to(beat.position_m, beat.speed_m_s)
        except RigError as error:
            return error.message, False
        into_skin = before is not None and beat.position_m > before.target
        self._into_skin, self._touched = into_skin and beat.command is CommandKind.MOVE_TO, False
        return "", False

    def _travel_reason(self, beat: Beat) -> str:
        """Return why other axes may not travel; empty: they may."""
        if not self._retracted or self._press.moving:
            return f"{self._name} is not retracted"
        for name, target in beat.targets.items():
            if name not in self._others:
                return f"{name} is no axis that travels"
            low, high = self._others[name].facts.limits
            if not low <= target <= high:
                return f"the target {target:g} m of {name} is outside its travel {low:g} to {high:g} m"
        return ""

    def _press_reason(self, beat: Beat, limits: Limits) -> str:
        """Return why the pressing axis may not move; empty: it may."""
        state, force_n = self._press.state, self._seen_force.force_n
        if state is None or math.isnan(state.target):
            return f"the target of {self._name} is not known"
        is_step = beat.command is CommandKind.STEP
        target_m = state.target + beat.distance_m if is_step else beat.position_m
        low, high = limits.travel_m
        longest_m = (self._steps(limits.step_m) + 0.5) * self._press.facts.resolution
        for wrong, reason in (
            (not low <= target_m <= high, f"the target {target_m:g} m is outside the travel {low:g} to {high:g} m"),
            (
                is_step and not abs(beat.distance_m) < longest_m,
                f"a step of {beat.distance_m:g} m is longer than {limits.step_m:g} m",
            ),
            (
                not is_step and not 0.0 < beat.speed_m_s <= limits.speed_m_s * (1 + 1e-9),
                f"a speed of {beat.speed_m_s:g} m/s is not within {limits.speed_m_s:g} m/s",
            ),
            (
                not is_step and target_m > state.target and not force_n < limits.touch_n,
                f"it would move into the skin in contact, at {force_n:.3f} N",
            ),
        ):
            if wrong:
                return reason
        return ""

    def _steps(self, distance_m: float) -> int:
        """Return the whole steps of the pressing axis that a distance is rounded to."""
        return round(abs(distance_m) / self._press.facts.resolution)

    def _halt(self, axis: Positioner) -> None:
        """Halt an axis; what fails of it becomes a retreat."""
        try:
            axis.halt()
        except TactbenchError as error:
            self._retreat(Trigger.AXIS_FAULT, error.message)

    # Retreat ----------------------------------------------------------------------------------------------------------

    def _retreat(self, trigger: Trigger, text: str) -> None:
        """Begin a retreat; the first reason stands."""
        if self._limits is None or self.state is not GuardState.ARMED:
            return
        self.state, self.trigger = GuardState.RETREATING, trigger
        self._into_skin = False
        self._began_ns = self._clock()
        self._send_retreat()
        self._tell(trigger, text)

    def _send_retreat(self) -> None:
        """Halt the other axes that move, and send the pressing axis away from the skin."""
        self._sent_ns = self._clock()
        self._counts["retreats_sent"] += 1
        moving = [name for name, axis in self._others.items() if axis.moving]
        for name in (*moving, self._name):
            if name in self._lost:
                continue
            try:
                if name == self._name:
                    self._press.retreat()
                else:
                    self._axes[name].halt()
            except (LinkUnplugged, LinkClosed):
                self._lost.add(name)
            except TactbenchError:
                self._counts["retreats_not_sent"] += 1

    def _carry_on(self) -> None:
        """See whether the pressing axis is there and the others stand; send it again, or end in a fault."""
        press, now_ns = self._press, self._clock()
        took = f"{1e-9 * (now_ns - self._began_ns):.3f} s"
        fresh = press.state is not None and press.state.t_ns > self._sent_ns
        # An axis that is lost while it moves ends its move by itself, which nobody sees.
        lost = sorted(name for name in self._lost if name == self._name or self._axes[name].moving)
        out = not press.moving and self._retracted and fresh
        others = any(axis.moving and name not in self._lost for name, axis in self._others.items())
        if lost and not others and (out or self._name in lost):
            self._end(Trigger.AXIS_LOST, f"stand clear: {', '.join(lost)} ends its last move and holds there")
        elif out and not others:
            self._end(None, f"out after {took}")
        elif now_ns > self._began_ns + 1e9 * retreat_seconds(press):
            self._retreat_failed(took)
        elif not press.moving and now_ns - self._sent_ns > 1e9 * AGAIN_S:
            self._send_retreat()

    def _retreat_failed(self, took: str) -> None:
        place = self._press.position
        where = "nobody knows where" if math.isnan(place) else f"last seen at {place:g} m"
        taken = power_off(self._press)
        power = "power taken off" if taken else "left under power, since it may fall without"
        self._end(Trigger.RETREAT_FAILED, f"RETREAT FAILED: not out after {took}, {where}; {power}: stand clear")

    def _end(self, failed: Trigger | None, text: str) -> None:
        ordinary = failed is None and self.trigger in (Trigger.COMMANDED, Trigger.TERMINATED)
        self.state = GuardState.RETREATED if ordinary else GuardState.FAULT
        if failed is not None:
            self._home_anew.update(self._lost, [self._name])
        self._not_out = "" if failed is None else text
        self._tell(failed, text)

    # Arming -----------------------------------------------------------------------------------------------------------

    def _check(self, limits: Limits) -> None:
        """Raise GuardRefusesError where limits and axes contradict each other."""
        facts, channels = self._press.facts, self.force_stream.channels
        low, high = limits.travel_m
        uninterruptible = [name for name, axis in self._axes.items() if not axis.facts.interruptible]
        endless = [name for name, axis in self._axes.items() if not all(map(math.isfinite, axis.facts.limits))]
        for wrong, problem in (
            (endless, f"no ends of travel are stated for {', '.join(endless)}"),
            (uninterruptible, f"moves of {', '.join(uninterruptible)} cannot be interrupted"),
            (
                not all(map(math.isfinite, (facts.retreat, facts.retreat_speed, facts.speed, facts.acceleration))),
                f"{self._name} does not state retreat, retreat speed, speed and acceleration",
            ),
            (not facts.corridor > 0, f"{self._name} does not state its corridor"),
            (not facts.limits[0] <= low < high <= facts.limits[1], "the travel is not within the axis' ends"),
            (not low <= facts.retreat < high, "the place to retreat to is not within the travel, away from its end"),
            (facts.corridor > limits.step_m, "the axis' corridor is longer than a step"),
            (len(limits.zero) != len(channels), f"the force has {len(channels)} channels and {len(limits.zero)} zeros"),
            (self._force_lost or self._lost, "a device is gone: close the guard and open a new one"),
        ):
            if wrong:
                raise GuardRefusesError(f"The guard does not arm: {problem}.", hint="See docs/hardware.md, Safety.")

    def _wait_for_force(self, limits: Limits) -> None:
        """Watch the unloaded force for a while; raises GuardRefusesError."""
        before = -1
        while self._seen_force.received != before:  # what has waited since nobody looked
            before = self._seen_force.received
            self._take_force(0.0, None)
        problem: Problem | None = None
        until_ns = self._clock() + round(1e9 * ALIVE_S)
        # A first sample may be as far away as its age may be.
        self._take_force(limits.force_age_s, None)
        while problem is None and self._clock() < until_ns:
            problem = self._take_force(LOOK_S, limits)
            for name, axis in self._axes.items():
                self._take_axis(name, axis, 0.0, None)
        if problem is not None:
            raise GuardRefusesError(
                f"The guard does not arm: {problem[0]}: {problem[1]}.",
                hint="Unload the force sensor, take its zero anew, and check its cable.",
            )

    def _make_ready(self, name: str, axis: Positioner, limits: Limits) -> None:
        """Home an axis that is not homed, under watch, give it power, and retract the pressing one."""
        problem: Problem | None = None

        def stop() -> bool:
            nonlocal problem
            problem = problem or self._take_force(0.0, limits)
            if problem is None and self._interrupted():
                problem = Trigger.TERMINATED, "interrupted"
            return problem is not None

        if name in self._home_anew or not (axis.homed or axis.find_home()):
            self._tell(None, f"homing {name}")
            try:
                axis.home(stop)
            except (RigError, LinkError) as error:
                self._homing_failed(name, *(problem or (Trigger.HOMING, error.message)))
        axis.confirm()
        if not axis.enabled:
            axis.enable()
        self._home_anew.discard(name)
        if axis is self._press:
            self._retract(limits)

    def _retract(self, limits: Limits) -> None:
        """Send the pressing axis to its place of retreat under watch; raises GuardRefusesError."""
        press = self._press
        deadline_ns = self._clock() + round(1e9 * retreat_seconds(press))
        press.retreat()
        sent_ns = self._clock()
        while True:
            problem = self._seen(LOOK_S, limits, travelling=True)
            if problem is None and self._interrupted():
                problem = Trigger.TERMINATED, "interrupted"
            if problem is None and self._clock() > deadline_ns:
                problem = Trigger.HOMING, "it has not come to its place of retreat in its time"
            if problem is not None:
                with suppress(TactbenchError):
                    press.halt()
                self._homing_failed(self._name, *problem)
            if not press.moving and self._retracted and press.state is not None and press.state.t_ns > sent_ns:
                return

    def _homing_failed(self, name: str, trigger: Trigger, text: str) -> NoReturn:
        self.state, self.trigger = GuardState.FAULT, Trigger.HOMING
        self._tell(Trigger.HOMING, f"{name}: {trigger}: {text}")
        raise GuardRefusesError(
            f"{name} stands where it was homed or retracted: {trigger}: {text}",
            hint="See what the indenter touches; then disarm, and arm again.",
        )

    # Telling ----------------------------------------------------------------------------------------------------------

    def _tell(self, trigger: Trigger | None, text: str) -> None:
        force_n = math.nan if self._watch is None else self._watch.force_n
        event = Event(self._clock(), self.state, trigger, force_n, self._press.position, text)
        self._events.append(event)
        self._on_event(event)

    def _report(self, sequence: int, reason: str = "", *, early: bool = False) -> Report:
        watch, state = self._seen_force, self._press.state
        return Report(
            sequence=sequence,
            t_ns=self._clock(),
            state=self.state,
            accepted=not reason,
            reason=reason,
            early=early,
            moving=self._moving,
            position_m=self._press.position,
            target_m=math.nan if state is None else state.target,
            positions={name: axis.position for name, axis in self._axes.items()},
            force_n=watch.force_n,
            force_sequence=watch.sequence,
            touched=self._touched,
            trigger=self.trigger,
            not_out=self._not_out,
        )


def retreat_seconds(press: Positioner) -> float:
    """Return within what time a retreat from anywhere has ended."""
    low, high = press.facts.limits
    return (high - low) / press.facts.retreat_speed + RETREAT_S


@contextmanager
def _named(name: str) -> Iterator[None]:
    """Say which device an error is of: there may be several of a kind."""
    try:
        yield
    except TactbenchError as error:
        error.message = f"{name}: {error.message}"
        raise

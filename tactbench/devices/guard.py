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

What it cannot promise: anything about people; a force sensor that lies plausibly (:mod:`.press` compares force and
place); forces that the sensor does not feel, such as the platform against the frame; a retreat or a halt of an axis
whose controller does not answer, which ends its move by itself; a place, where a controller lost steps.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping, MutableSequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import NoReturn, TypeVar

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

T = TypeVar("T")

FORCE = "force"
"""What the force sensor is called beside the axes."""
LOOK_S = 1e-3
"""Longest wait between two looks: the sampling period of the force."""
ALIVE_S = 0.2
"""For so long the force is watched before anything moves (assumed: 200 samples at 1 kHz)."""
AGAIN_S = 0.25
"""After which a retreat that is not under way is sent again (assumed: above the time of an answer at 9600 baud)."""
RETREAT_S = 1.0
"""Added to the time of the way, or of the force's mean after it, after which a retreat has failed (assumed)."""
REFUSED = 3
"""Refused commands in a row that end the rig's command (assumed)."""


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
        Lets time pass until a nanosecond of the clock; used only where the force sensor's link cannot be waited for.
    on_event
        Called with each event.
    interrupted
        Called while axes are homed: whether they shall stand.
    kept
        A file that is there from arming until the pressing axis was seen to be clear of the sensor, and says why it is
        not: the next guard with this file begins with it. None: nothing is kept.
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
        self._limits: Limits | None = None
        self._motor_blocks: deque[Block] = deque(maxlen=MOST_BLOCKS)
        self._events: list[Event] = []
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
        """The force sensor's stream."""
        (stream,) = self._force.streams
        return stream

    @property
    def motor_stream(self) -> StreamSpec:
        """The pressing axis' stream."""
        (stream,) = self._press.streams
        return stream

    # What a rig asks for ----------------------------------------------------------------------------------------------

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Ask all devices who they are, and let them sample."""
        found = {}
        for name, device in {**self._axes, FORCE: self._force}.items():
            try:
                found[name] = dict(device.identify())
                device.start()
            except TactbenchError as error:
                error.message = f"{name}: {error.message}"
                raise
        self._say(None, "started")
        return found

    def arm(self, limits: Limits) -> Report:
        """Check, home what is not homed, retract the pressing axis, and begin to expect beats.

        The first beat is due within `heartbeat_s`. Samples from before are dropped.

        Raises
        ------
        GuardRefusesError
            If something is not as it must be; nothing was moved, or what was begun has ended. The state is IDLE, or
            FAULT if force or an axis went wrong while homing.
        """
        if self.state is not GuardState.IDLE:
            raise GuardRefusesError(f"The guard is in state {self.state}.", hint="Disarm it first.")
        self._check(limits)
        if not limits.confirmed and (unclear := self._unclear):
            raise GuardRefusesError(
                f"The guard does not arm: {unclear}.",
                hint="An operator has to see that the indenter is clear of the sensor, and to say so.",
            )
        self._wait_for_force(limits)
        try:
            self._keep(f"it was armed at {datetime.now().isoformat(' ', 'seconds')}, and not seen to be out since")
        except OSError as error:
            raise GuardRefusesError(
                f"The guard does not arm: it cannot keep that it is armed in {self._kept}: {error}.",
                hint="Make room, or name another file as `guard_log:` in the rig file.",
            ) from error
        self._not_out = ""
        for name, axis in self._axes.items():
            try:
                self._make_ready(name, axis, limits)
            except Exception as error:
                self._home_anew.add(name)
                if isinstance(error, GuardRefusesError):
                    raise
                hint = getattr(error, "hint", "")
                raise GuardRefusesError(f"{name} is not armed: {fault_text(error)}.", hint=hint) from error
        self.state, self._limits = GuardState.ARMED, limits
        self._refused, self._touched = 0, False
        self._end_sequence = self._watch.sequence
        # What came while axes were homed may be a minute of samples: handing it over would take a beat's time.
        self._watch.blocks.clear()
        self._motor_blocks.clear()
        self._beat_ns = self._clock()
        self._say(None, "armed")
        return self._report()

    def beat(self, beat: Beat) -> Report:
        """Say that the rig is there, and what shall be done; return at once."""
        limits = self._limits
        if self.state is GuardState.ARMED and limits is not None:
            self._counts["beats"] += 1
            self._see_beat(beat.t_ns, limits)
            self._beat_ns = min(beat.t_ns, self._clock())
        self.look(0.0)
        # What this look has found stands before the command.
        if self.state is not GuardState.ARMED or limits is None:
            return self._report(f"the guard is in state {self.state}")
        reason, early = self._command(beat, limits)
        if early:
            self._counts["early"] += 1
        elif reason:
            self._counts["refused"] += 1
            self._refused += 1
            self._say(None, f"refused in {beat.state or 'no state'}: {reason}")
            if self._refused >= REFUSED:
                self.trip(Trigger.COMMANDS_REFUSED, f"{REFUSED} in a row, the last because {reason}")
        elif beat.command is not CommandKind.NONE:
            self._refused = 0
        return self._report(reason, early=early)

    def advance(self, until_ns: int) -> None:
        """Look until the clock says so much."""
        while (left_ns := until_ns - self._clock()) > 0:
            self.look(min(LOOK_S, 1e-9 * left_ns))

    def force_blocks(self) -> list[Block]:
        """Return all force samples since the last call, but for those that came twice or after newer ones."""
        return taken(self._watch.blocks)

    def motor_blocks(self) -> list[Block]:
        """Return all states of the pressing axis since the last call."""
        return taken(self._motor_blocks)

    def events(self) -> list[Event]:
        """Return what has happened since the last call."""
        return taken(self._events)

    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Return the drivers' counts, and the guard's ``beats``, ``early``, ``refused``.

        To the force sensor's the guard adds ``duplicates`` and ``late`` samples, kept out, and ``gaps``, missing.
        """
        force, order = Counter(self._force.counts), self._watch.order
        force.update(duplicates=order.duplicates, late=order.late, gaps=order.gaps)
        axes = {name: dict(axis.counts) for name, axis in self._axes.items()}
        return {FORCE: {name: count for name, count in force.items() if count}, **axes, "guard": dict(self._counts)}

    def disarm(self) -> Report:
        """Retreat, and expect no more beats; a fault is cleared.

        What `Report.not_out` says stays until an operator has confirmed that it is clear, also for the next guard.
        """
        self.trip(Trigger.COMMANDED, "disarmed")
        while self.state is GuardState.RETREATING:
            self.look(LOOK_S)
        if self.state is not GuardState.IDLE:
            self.state = GuardState.IDLE
            self._say(None, "disarmed")
        self._limits, self.trigger = None, None
        return self._report()

    def close(self) -> None:
        """Disarm, and close all devices; once closed, this does nothing."""
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
        """Take what has come, waiting at most so long for a force sample, and act on it."""
        began_ns = self._clock()  # where this look itself is held up, a beat may wait that nobody has heard yet
        watched = self._limits if self.state in (GuardState.ARMED, GuardState.RETREATING) else None
        problem = self._seen(timeout_s, watched, travelling=any(axis.moving for axis in self._others.values()))
        limits = self._limits
        if limits is None:
            return
        if problem is not None:
            self.trip(*problem)
        self._see_beat(began_ns, limits)
        touched = self._into_skin and self._press.moving and self._watch.touched(limits.touch_n)
        if self.state is GuardState.ARMED and touched:
            self._into_skin, self._touched = False, True
            self._halt(self._press)
            self._say(None, "touch: the axis holds")
        if self.state is GuardState.RETREATING:
            self._carry_on()

    @property
    def _moving(self) -> bool:
        return any(axis.moving for axis in self._axes.values())

    @property
    def _retracted(self) -> bool:
        return self._press.homed and self._press.at(self._press.facts.retreat)

    @property
    def _unclear(self) -> str:
        """Why an operator has to see that the indenter is clear of the sensor; empty: it needs not."""
        here = [
            name
            for name, axis in self._axes.items()
            if axis.facts.homes_here and (name in self._home_anew or not axis.homed)
        ]
        return self._not_out or (f"{', '.join(here)} is homed where it stands" if here else "")

    def _see_beat(self, now_ns: int, limits: Limits) -> None:
        age_s = 1e-9 * (now_ns - self._beat_ns)
        if age_s > limits.heartbeat_s:
            self.trip(Trigger.BEAT_OLD, f"no beat for {1e3 * age_s:.1f} ms, {1e3 * limits.heartbeat_s:.1f} may be")

    def _seen(self, timeout_s: float, limits: Limits | None, *, travelling: bool) -> Problem | None:
        """Take what all devices have sent; return the first thing that is wrong, of the force first."""
        problem = self._take_force(timeout_s, limits, travelling=travelling)
        for name, axis in self._axes.items():
            found = self._take_axis(name, axis, limits)
            problem = problem or found
        return problem

    def _take_force(self, timeout_s: float, limits: Limits | None, *, travelling: bool = True) -> Problem | None:
        if FORCE in self._lost:
            self._advance(self._clock() + round(1e9 * timeout_s))
            return None if limits is None else (Trigger.FORCE_LOST, "the force sensor is gone")
        watch, problem = self._watch, None
        try:
            blocks = self._force.read(timeout_s)
        except Exception as error:
            self._lost.add(FORCE)
            return Trigger.FORCE_LOST, fault_text(error)
        for block in blocks:
            found = watch.take(block, limits, travelling=travelling)
            problem = problem or found
        return problem or (None if limits is None else watch.old(self._clock(), limits))

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
            self._motor_blocks += blocks
            if was_moving and not axis.moving:
                self._end_sequence = self._watch.sequence
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
                self.trip(Trigger.COMMANDED, "the rig has commanded it")
                return "", False
            case CommandKind.STOP:
                self._into_skin = False
                for axis in self._axes.values():
                    if axis.moving:
                        self._halt(axis)
                return "", False
        if beat.force_sequence > self._watch.sequence:
            return f"force sample {beat.force_sequence} has not come", False
        reason = self._travel_reason(beat) if beat.command is CommandKind.TRAVEL else self._press_reason(beat, limits)
        if reason:
            return reason, False
        if self._moving:
            return "an axis is moving", True
        if min(beat.force_sequence, self._watch.changed) <= self._end_sequence:
            return "no force sample is known from after the last move", True
        self._into_skin = self._touched = False
        press = self._press
        try:
            if beat.command is CommandKind.TRAVEL:
                for name, target in beat.targets.items():
                    self._others[name].move_to(target)
            elif beat.command is CommandKind.STEP:
                press.move_by(beat.distance_m)
            else:
                self._into_skin = press.state is not None and beat.position_m > press.state.target
                press.move_to(beat.position_m, beat.speed_m_s)
        except Exception as error:  # of the axis' driver: whatever it is, it was not carried out
            return fault_text(error), False
        return "", False

    def _travel_reason(self, beat: Beat) -> str:
        if not self._retracted or self._press.moving:
            return f"{self._name} is not retracted"
        for name, target in beat.targets.items():
            low, high = self._others[name].facts.limits if name in self._others else (math.nan, math.nan)
            if not low <= target <= high:
                return f"the target {target:g} m of {name} is outside its travel {low:g} to {high:g} m"
        return ""

    def _press_reason(self, beat: Beat, limits: Limits) -> str:
        """Return why the pressing axis may not move; empty: it may."""
        state, force_n = self._press.state, self._watch.force_n
        if state is None or math.isnan(state.target):
            return f"the target of {self._name} is not known"
        is_step = beat.command is CommandKind.STEP
        target_m = state.target + beat.distance_m if is_step else beat.position_m
        low, high = limits.travel_m
        if not low <= target_m <= high:
            return f"the target {target_m:g} m is outside the travel {low:g} to {high:g} m"
        if is_step:
            resolution = self._press.facts.resolution
            longest_m = (round(limits.step_m / resolution) + 0.5) * resolution
            return "" if abs(beat.distance_m) < longest_m else f"a step of {beat.distance_m:g} m is longer than allowed"
        if not 0.0 < beat.speed_m_s <= limits.speed_m_s * (1 + 1e-9):
            return f"a speed of {beat.speed_m_s:g} m/s is not within {limits.speed_m_s:g} m/s"
        if target_m > state.target and not force_n < limits.touch_n:
            return f"it would move into the skin in contact, at {force_n:.3f} N"
        return ""

    def _halt(self, axis: Positioner) -> None:
        """Halt an axis; what fails of it becomes a retreat."""
        try:
            axis.halt()
        except Exception as error:
            self.trip(Trigger.AXIS_FAULT, fault_text(error))

    # Retreat ----------------------------------------------------------------------------------------------------------

    def trip(self, trigger: Trigger, text: str) -> None:
        """Begin a retreat, if the guard is armed; the first reason stands."""
        if self.state is not GuardState.ARMED:
            return
        self.state, self.trigger = GuardState.RETREATING, trigger
        self._into_skin = False
        self._began_ns = self._clock()
        self._send_retreat()
        self._say(trigger, text)

    def _send_retreat(self) -> None:
        self._sent_ns = self._clock()
        commands = {name: axis.halt for name, axis in self._others.items() if axis.moving}
        # A place that is not known any more is no aim: it may be on the other side.
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

    def _carry_on(self) -> None:
        """See whether the pressing axis is out and the others stand; send it again, or end in a fault.

        It is out where it stands at its place of retreat and the mean force since is near zero.
        """
        press, now_ns, limits = self._press, self._clock(), self._limits
        assert limits is not None
        took = f"{1e-9 * (now_ns - self._began_ns):.3f} s"
        fresh = press.state is not None and press.state.t_ns > self._sent_ns
        # An axis that is lost while it moves ends its move by itself, which nobody sees.
        lost = sorted(name for name in self._lost - {FORCE} if name == self._name or self._axes[name].moving)
        there = not press.moving and self._retracted and fresh
        self._there_ns = (self._there_ns or now_ns) if there else 0
        force_n = self._watch.mean_n(self._there_ns, samples(self.force_stream, limits.clear_s)) if there else math.nan
        out = abs(force_n) < limits.clear_n
        others = any(axis.moving and name not in self._lost for name, axis in self._others.items())
        if lost and not others and (there or self._name in lost):
            self._end(Trigger.AXIS_LOST, f"stand clear: {', '.join(lost)} ends its last move and holds there")
        elif out and not others:
            self._end(None, f"out after {took}")
        elif there and not others:
            if FORCE in self._lost or now_ns > self._there_ns + 1e9 * (limits.clear_s + RETREAT_S):
                known = "is not known" if math.isnan(force_n) else f"is {force_n:.2f} N"
                self._end(
                    Trigger.NOT_CLEAR,
                    f"NOT KNOWN TO BE OUT: at its place of retreat after {took}, and the force {known}: stand clear, "
                    "and see what the indenter touches",
                )
        elif now_ns > self._began_ns + 1e9 * retreat_seconds(press):
            where = "nobody knows where" if math.isnan(press.position) else f"last seen at {press.position:g} m"
            power = "left under power, since it may fall without"
            if press.facts.holds_unpowered:
                with suppress(LinkError, RigError):
                    press.disable()
                    power = "power taken off"
            self._end(Trigger.RETREAT_FAILED, f"RETREAT FAILED: not out after {took}, {where}; {power}: stand clear")
        elif not press.moving and now_ns - self._sent_ns > 1e9 * AGAIN_S:
            self._send_retreat()

    def _end(self, failed: Trigger | None, text: str) -> None:
        ordinary = failed is None and self.trigger in (Trigger.COMMANDED, Trigger.TERMINATED)
        self.state = GuardState.RETREATED if ordinary else GuardState.FAULT
        if failed is not None:
            self._home_anew.update(self._lost, [self._name])
            self._not_out = text
        with suppress(OSError):  # then the file says that it was armed
            self._keep(self._not_out)
        self._say(failed, text)

    def _keep(self, text: str) -> None:
        """Keep for the next guard why the pressing axis is not known to be out; empty: it is."""
        if self._kept is not None and text:
            self._kept.write_text(text, encoding="utf-8")
        elif self._kept is not None:
            self._kept.unlink(missing_ok=True)

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
            (self._lost, "a device is gone: close the guard and open a new one"),
        ):
            if wrong:
                raise GuardRefusesError(f"The guard does not arm: {problem}.", hint="See docs/hardware.md, Safety.")

    def _wait_for_force(self, limits: Limits) -> None:
        """Watch the unloaded force for a while; raises GuardRefusesError."""
        before = -1
        while self._watch.received != before:  # what has waited since nobody looked
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
        """Home an axis that is not homed, under watch, give it power, and retract the pressing one."""
        problem: Problem | None = None

        def stop() -> bool:
            nonlocal problem
            problem = problem or self._take_force(0.0, limits) or self._interruption()
            return problem is not None

        if name in self._home_anew or not (axis.homed or axis.find_home()):
            self._say(None, f"homing {name}")
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
            problem = self._seen(LOOK_S, limits, travelling=True) or self._interruption()
            if problem is None and self._clock() > deadline_ns:
                problem = Trigger.HOMING, "it has not come to its place of retreat in its time"
            if problem is not None:
                self._homing_failed(self._name, *problem)

    def _interruption(self) -> Problem | None:
        return (Trigger.TERMINATED, "interrupted") if self._interrupted() else None

    def _homing_failed(self, name: str, trigger: Trigger, text: str) -> NoReturn:
        stands = self._stands(name)
        self.state, self.trigger = GuardState.FAULT, Trigger.HOMING
        self._say(Trigger.HOMING, f"{name}: {trigger}: {text}")
        if not stands:
            self._not_out = f"{name} was halted while it was homed or retracted, and is not known to stand: stand clear"
        raise GuardRefusesError(
            f"{name} stands where it was homed or retracted: {trigger}: {text}"
            if stands
            else f"{self._not_out}: {trigger}: {text}",
            hint="See what the indenter touches; then disarm, and arm again.",
        )

    def _stands(self, name: str) -> bool:
        """Halt an axis, again and again, and return whether it says the same place for a while."""
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

    # Saying -----------------------------------------------------------------------------------------------------------

    def _say(self, trigger: Trigger | None, text: str) -> None:
        event = Event(self._clock(), self.state, trigger, self._watch.force_n, self._press.position, text)
        self._events.append(event)
        self._on_event(event)

    def _report(self, reason: str = "", *, early: bool = False) -> Report:
        watch, state = self._watch, self._press.state
        return Report(
            t_ns=self._clock(),
            state=self.state,
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
            unclear=self._unclear,
        )


def retreat_seconds(press: Positioner) -> float:
    """Return within what time a retreat from anywhere has ended."""
    low, high = press.facts.limits
    return (high - low) / press.facts.retreat_speed + RETREAT_S


def taken(kept: MutableSequence[T]) -> list[T]:
    """Empty a list, and return what was in it."""
    found = list(kept)
    kept.clear()
    return found

"""The guard of the linear motor: carries out a rig's commands within limits, and retreats when anything is wrong.

It looks at force and motor every millisecond. What makes it retreat, and what it refuses, is the table of
docs/hardware.md, Safety. What it promises, of a motor that does as its driver assumes:

- *Steps.* One increment is out at a time, and the next is sent only if a force sample that was taken after the end of
  the one before is below the ceiling, and is another one in number and value than the sample before it. So the force
  never exceeds F_c + k (step_m + corridor_m) and the noise of one sample, whatever the line's rate and whoever hangs
  (derived; k the largest stiffness at the ceiling F_c, step_m rounded to increments of the drive, corridor_m how near
  to its target the drive calls a move ended). A line that falls silent lets the motor end one increment.
- *Moves at a speed v* (approach): F_max = F_c + k v t_r + k v^2/(2 acc) of :mod:`worst_case`, with t_r of
  :func:`reaction`: age of the force, one look of the guard and its scheduling, the bytes ahead of the retreat and the
  retreat itself on the line, the motor's lag.
- *A rig that hangs or dies* makes the motor begin to retreat within heartbeat_s + t_r.

Nothing here protects people: docs/hardware.md.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple, NoReturn

from tactbench.plugin import Block, RigError, StreamSpec, TactbenchError
from tactbench.plugin.devices import (
    Clock,
    Driver,
    LinkClosed,
    LinkError,
    LinkTimeout,
    LinkUnplugged,
    SequenceCheck,
)
from tactbench.rigs.parallel_manipulator.force_watch import ForceWatch, Problem
from tactbench.rigs.parallel_manipulator.guard_interface import (
    Beat,
    CommandKind,
    Event,
    GuardRefusesError,
    GuardState,
    Limits,
    Report,
    Trigger,
)
from tactbench.rigs.parallel_manipulator.motor.codec import OperationStatus
from tactbench.rigs.parallel_manipulator.motor.driver import FaulhaberDriver
from tactbench.rigs.parallel_manipulator.motor.errors import AnswerMissingError, MotorError, MotorSilentError
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.motor.retreat import retreat_command
from tactbench.rigs.parallel_manipulator.worst_case import Reaction

LOOK_S = 1e-3
"""Longest wait between two looks: the sampling period of the force."""
ALIVE_S = 0.2
"""For so long the force is watched before anything moves (assumed: 200 samples at 1 kHz)."""
AGAIN_S = 0.25
"""After which a retreat that is not under way is sent again (assumed: above the time of an answer at 9600 baud)."""
REFUSED = 3
"""Refused commands in a row that end the rig's command (assumed)."""
LONGEST_COMMAND = 9
"""Bytes that may be ahead of a retreat: one command is out at a time, the longest `LA-12345` (derived)."""

MANDATORY = (
    "lower_m",
    "upper_m",
    "speed_m_s",
    "acceleration_m_s2",
    "corridor_m",
    "peak_current_a",
    "continuous_current_a",
    "retreat_m",
    "retreat_speed_m_s",
)
"""Options of the motor without which it is not armed."""

_ORDINARY = (Trigger.COMMANDED, Trigger.TERMINATED)
_HOME_ANEW = (
    Trigger.MOTOR_FAULT,
    Trigger.MOTOR_LOST,
    Trigger.MOTOR_SILENT,
    Trigger.DEVIATION,
    Trigger.HOMING,
    Trigger.RETREAT_FAILED,
)
_BITS = {
    OperationStatus.CURRENT_LIMITATION: Trigger.CURRENT_LIMIT,
    OperationStatus.DEVIATION_ERROR: Trigger.DEVIATION,
}
_ANY_BIT = sum(_BITS)


def reaction(options: FaulhaberOptions, *, force_age_s: float = 1e-3, motor_lag_s: float = 10e-3) -> Reaction:
    """Return what passes between a force and the motor's braking, for the retreat of these options.

    Parameters
    ----------
    options
        Of the motor; they name a place and a speed to retreat to.
    force_age_s
        Sampling period and delay of the force sensor; one millisecond is assumed.
    motor_lag_s
        Of the motor and its drive; ten milliseconds are assumed.
    """
    # A look more than the force's age: the guard may just have looked.
    return Reaction(
        baud=options.baud,
        force_age_s=force_age_s + LOOK_S,
        bytes_in_flight=LONGEST_COMMAND,
        stop_bytes=len(retreat_command(options)),
        motor_lag_s=motor_lag_s,
    )


class _Verdict(NamedTuple):
    accepted: bool
    reason: str = ""
    early: bool = False


class LocalGuard:
    """A guard over two open drivers, in the process and the time of whoever holds it; a :class:`Guard`.

    Parameters
    ----------
    motor, force
        Open, not started; closed with the guard. The force sensor has one stream.
    clock
        That of both.
    advance
        Lets time pass until a nanosecond of the clock; used only where neither device's link can be waited for.
    on_event
        Called with each event.
    interrupted
        Asked while the motor is homed: whether it shall stand.
    """

    def __init__(
        self,
        motor: FaulhaberDriver,
        force: Driver,
        clock: Clock,
        advance: Callable[[int], None],
        *,
        on_event: Callable[[Event], None] = lambda event: None,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self.state = GuardState.IDLE
        self.trigger: Trigger | None = None
        self._motor, self._force, self._clock, self._advance = motor, force, clock, advance
        self._on_event, self._interrupted = on_event, interrupted
        self._watch: ForceWatch | None = None
        self._order = SequenceCheck()
        self._limits: Limits | None = None
        self._force_blocks: list[Block] = []
        self._motor_blocks: list[Block] = []
        self._events: list[Event] = []
        self._reports: list[str] = []
        self._not_out = ""
        self._counts: Counter[str] = Counter()
        self._force_lost = self._motor_lost = self._home_anew = self._closed = False
        self._beats = self._refused = 0
        self._beat_ns = 0
        self._end_sequence = -1
        self._into_skin = self._touched = False
        self._began_ns = self._sent_ns = self._deadline_ns = 0

    # What a rig asks for ----------------------------------------------------------------------------------------------

    @property
    def force_stream(self) -> StreamSpec:
        """The force sensor's stream."""
        (stream,) = self._force.streams
        return stream

    @property
    def motor_stream(self) -> StreamSpec:
        """The motor's stream."""
        (stream,) = self._motor.streams
        return stream

    def start(self) -> Mapping[str, Mapping[str, str]]:
        """Ask both devices who they are, and let them sample; see :meth:`Guard.start`."""
        if len(self._force.streams) != 1:
            raise RigError("The guard needs a force sensor with one stream.")
        identity = {"motor": dict(self._motor.identify()), "force": dict(self._force.identify())}
        self._motor.start()
        self._force.start()
        self._watch = ForceWatch(self.force_stream)
        self._tell(None, "started")
        return identity

    def arm(self, limits: Limits) -> Report:
        """Check, home, retract and begin to expect beats; see :meth:`Guard.arm`."""
        again = self.state is GuardState.ARMED
        if not (again or self.state is GuardState.IDLE):
            raise GuardRefusesError(f"The guard is in state {self.state}.", hint="Disarm it first.")
        if again and (self._motor.moving or not self._at(limits.retreat_m)):
            raise GuardRefusesError("The guard is armed, and the motor is not at rest at retreat_m.")
        self._check(limits)
        self.state, self._limits, self.trigger = GuardState.IDLE, None, None
        careful = replace(limits, force_ceiling_n=limits.homing_force_n, touch_n=0.5 * limits.homing_force_n)
        self._wait_for_force(careful)
        try:
            if not self._motor.homed or self._home_anew:
                self._home(careful)
            self._motor.confirm()
            if not self._motor.enabled:
                self._motor.enable()
            self._retract(careful)
        except (MotorError, LinkError) as error:
            self._home_anew = True
            raise GuardRefusesError(f"The motor is not armed: {error.message}", hint=error.hint) from error
        self._home_anew = False
        self.state, self._limits = GuardState.ARMED, limits
        self._beats, self._refused, self._touched = 0, 0, False
        self._beat_ns = self._clock()
        self._tell(None, "armed")
        return self._report(0, _Verdict(True))

    def beat(self, beat: Beat) -> Report:
        """Take a beat; see :meth:`Guard.beat`."""
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
            return self._report(beat.sequence, _Verdict(False, f"the guard is in state {self.state}"))
        verdict = self._command(beat, limits)
        if verdict.accepted and beat.command is not CommandKind.NONE:
            self._refused = 0
        elif verdict.early:
            self._counts["early"] += 1
        elif not verdict.accepted:
            self._counts["refused"] += 1
            self._refused += 1
            self._tell(None, f"refused in {beat.state or 'no state'}: {verdict.reason}")
            if self._refused >= REFUSED:
                self._retreat(Trigger.COMMANDS_REFUSED, f"{REFUSED} in a row, the last because {verdict.reason}")
        return self._report(beat.sequence, verdict)

    def advance(self, until_ns: int) -> None:
        """Look until the clock says so much."""
        while (left_ns := until_ns - self._clock()) > 0:
            self.look(min(LOOK_S, 1e-9 * left_ns))

    def force_blocks(self) -> list[Block]:
        """Return all force samples since the last call, but for those that came twice or after newer ones."""
        found, self._force_blocks = self._force_blocks, []
        return found

    def motor_blocks(self) -> list[Block]:
        """Return all samples of the motor since the last call."""
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
        return {"force": force, "motor": dict(self._motor.counts), "guard": dict(self._counts)}

    def disarm(self) -> Report:
        """Retreat if the motor is not at its place, and expect no more beats; a fault is cleared."""
        if self.state is GuardState.ARMED and (
            self._motor.moving or self._limits is None or not self._at(self._limits.retreat_m)
        ):
            self._retreat(Trigger.COMMANDED, "disarmed")
        while self.state is GuardState.RETREATING:
            self.look(LOOK_S)
        if self.state is not GuardState.IDLE:
            self.state = GuardState.IDLE
            self._tell(None, "disarmed")
        self._limits, self.trigger = None, None
        report, self._not_out = self._report(0, _Verdict(True)), ""
        return report

    def abandon(self) -> None:
        """Close the motor's link and send nothing more: for whoever goes on without this guard."""
        self._motor.close()
        self._motor_lost, self.state = True, GuardState.FAULT

    def close(self) -> None:
        """Disarm, and close both devices; once closed, this does nothing."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._watch is not None:  # else it was not started: there is nothing to disarm
                self.disarm()
        finally:
            try:
                self._motor.close()
            finally:
                self._force.close()

    # Looking ----------------------------------------------------------------------------------------------------------

    def look(self, timeout_s: float) -> None:
        """Take what has come, waiting at most so long for a force sample, and act on it."""
        watched = self._limits if self.state in (GuardState.ARMED, GuardState.RETREATING) else None
        problem = self._seen(timeout_s, watched)
        limits = self._limits
        if limits is None:
            return
        if self.state is GuardState.ARMED:
            now_ns = self._clock()
            late = now_ns - self._beat_ns > 1e9 * limits.heartbeat_s
            problem = problem or (self._late(now_ns, limits) if late else None)
            if problem is not None:
                self._retreat(*problem)
            elif self._into_skin and self._motor.moving and self._seen_force.touched(limits.touch_n):
                self._into_skin, self._touched = False, True
                self._send(self._motor.halt)
                self._tell(None, "touch: the motor holds")
        if self.state is GuardState.RETREATING:
            self._carry_on(limits)

    def trip(self, trigger: Trigger, text: str) -> None:
        """Retreat for a reason from outside; nothing if the guard is not armed."""
        if self.state is GuardState.ARMED:
            self._retreat(trigger, text)

    @property
    def _seen_force(self) -> ForceWatch:
        if self._watch is None:
            raise GuardRefusesError("The guard was not started.", hint="Use start().")
        return self._watch

    def _late(self, now_ns: int, limits: Limits) -> Problem:
        age_s = 1e-9 * (now_ns - self._beat_ns)
        return Trigger.BEAT_OLD, f"no beat for {1e3 * age_s:.1f} ms, {1e3 * limits.heartbeat_s:.1f} may be"

    def _seen(self, timeout_s: float, limits: Limits | None) -> Problem | None:
        """Take what both devices have sent; return the first thing that is wrong, of the force first."""
        of_force = self._take_force(timeout_s, limits)
        of_motor = self._take_motor(timeout_s if self._force_lost else 0.0, limits)
        if self._force_lost and self._motor_lost and timeout_s > 0.0:
            self._advance(self._clock() + round(1e9 * timeout_s))
        return of_force or of_motor

    def _take_force(self, timeout_s: float, limits: Limits | None) -> Problem | None:
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
            found = watch.take(block, newer, limits)
            problem = problem or found
        return problem or (None if limits is None else watch.old(self._clock(), limits))

    def _take_motor(self, timeout_s: float, limits: Limits | None) -> Problem | None:
        if self._motor_lost:
            return Trigger.MOTOR_LOST, "the motor's link is gone"
        was_moving = self._motor.moving
        try:
            self._motor_blocks += self._motor.read(timeout_s)
        except (LinkUnplugged, LinkClosed) as error:
            self._motor_lost = True
            return Trigger.MOTOR_LOST, error.message
        except (MotorSilentError, AnswerMissingError, LinkTimeout) as error:
            return Trigger.MOTOR_SILENT, error.message
        except MotorError as error:
            return Trigger.MOTOR_FAULT, error.message
        if was_moving and not self._motor.moving:
            self._end_sequence = self._seen_force.sequence
            self._into_skin = False
        state = self._motor.state
        if limits is not None and state is not None and int(state.status) & _ANY_BIT:
            for bit, trigger in _BITS.items():
                if state.status & bit:
                    return trigger, f"the drive says {(bit.name or '').lower().replace('_', ' ')}"
        return None

    # Commands ---------------------------------------------------------------------------------------------------------

    def _command(self, beat: Beat, limits: Limits) -> _Verdict:
        """Carry out what a beat asks for, or say why not."""
        match beat.command:
            case CommandKind.NONE:
                return _Verdict(True)
            case CommandKind.RETREAT:
                self._retreat(Trigger.COMMANDED, "the rig has commanded it")
                return _Verdict(True)
            case CommandKind.STOP:
                if self._motor.moving:
                    self._into_skin = False
                    self._send(self._motor.halt)
                return _Verdict(True)
        state, watch = self._motor.state, self._seen_force
        if state is None or math.isnan(state.target_m):
            return _Verdict(False, "the motor's target is not known")
        is_step = beat.command is CommandKind.STEP
        target_m = state.target_m + beat.distance_m if is_step else beat.position_m
        low, high = limits.travel_m
        into_skin = target_m > state.target_m
        rounding, most = 1 + 1e-9, self._steps(limits.step_m)
        for wrong, reason in (
            (not low <= target_m <= high, f"the target {target_m:g} m is outside the travel {low:g} to {high:g} m"),
            (
                is_step and not (math.isfinite(beat.distance_m) and self._steps(beat.distance_m) <= most),
                f"a step of {beat.distance_m:g} m is longer than {limits.step_m:g} m",
            ),
            (
                not is_step and not 0.0 < beat.speed_m_s <= limits.speed_m_s * rounding,
                f"a speed of {beat.speed_m_s:g} m/s is not within {limits.speed_m_s:g} m/s",
            ),
            (beat.force_sequence > watch.sequence, f"force sample {beat.force_sequence} has not come"),
            (
                not is_step and into_skin and not watch.force_n < limits.touch_n,
                f"it would move into the skin in contact, at {watch.force_n:.3f} N",
            ),
        ):
            if wrong:
                return _Verdict(False, reason)
        if self._motor.moving:
            return _Verdict(False, "the motor is moving", early=True)
        if min(beat.force_sequence, watch.changed) <= self._end_sequence:
            return _Verdict(False, "no force sample is known from after the last move", early=True)
        try:
            if is_step:
                self._motor.move_by(beat.distance_m)
            else:
                self._motor.move_to(beat.position_m, beat.speed_m_s)
        except RigError as error:
            return _Verdict(False, error.message)
        self._into_skin, self._touched = into_skin and not is_step, False
        return _Verdict(True)

    def _steps(self, distance_m: float) -> int:
        """Return the whole increments of the drive that a distance is rounded to."""
        return abs(self._motor.options.profile().increments(distance_m))

    def _send(self, order: Callable[[], None]) -> None:
        """Give the motor an order of several commands at once; what fails of it becomes a retreat."""
        try:
            order()
        except TactbenchError as error:
            self._retreat(Trigger.MOTOR_FAULT, error.message)

    # Retreat ----------------------------------------------------------------------------------------------------------

    def _retreat(self, trigger: Trigger, text: str) -> None:
        """Begin a retreat; the first reason stands."""
        limits = self._limits
        if limits is None or self.state is not GuardState.ARMED:
            return
        self.state, self.trigger = GuardState.RETREATING, trigger
        self._home_anew |= trigger in _HOME_ANEW
        self._into_skin = False
        self._began_ns = self._clock()
        self._deadline_ns = self._began_ns + round(1e9 * limits.retreat_s)
        self._send_retreat()
        self._tell(trigger, text)

    def _send_retreat(self) -> None:
        self._sent_ns = self._clock()
        self._counts["retreats_sent"] += 1
        try:
            self._motor.retreat()
        except (LinkUnplugged, LinkClosed):
            self._motor_lost = True
        except TactbenchError:
            self._counts["retreats_not_sent"] += 1

    def _carry_on(self, limits: Limits) -> None:
        """See whether the motor is there; send it again, or end in a fault."""
        now_ns, state = self._clock(), self._motor.state
        took = f"{1e-9 * (now_ns - self._began_ns):.3f} s"
        if self._motor_lost:
            self._end(Trigger.MOTOR_LOST, "stand clear: the motor ends its last move and holds there")
        elif not self._motor.moving and self._at(limits.retreat_m) and state is not None and state.t_ns > self._sent_ns:
            self._end(None, f"out after {took}")
        elif now_ns > self._deadline_ns:
            where = "nobody knows where" if state is None else f"last seen at {state.position_m:g} m"
            with suppress(TactbenchError):
                self._motor.disable()
            self._end(
                Trigger.RETREAT_FAILED, f"RETREAT FAILED: not out after {took}, {where}; power taken off: stand clear"
            )
        elif not self._motor.moving and now_ns - self._sent_ns > 1e9 * AGAIN_S:
            self._send_retreat()

    def _end(self, failed: Trigger | None, text: str) -> None:
        ordinary = failed is None and self.trigger in _ORDINARY
        self.state = GuardState.RETREATED if ordinary else GuardState.FAULT
        self._home_anew |= failed is not None
        self._not_out = "" if failed is None else text
        self._tell(failed, text)

    def _at(self, position_m: float) -> bool:
        state, options = self._motor.state, self._motor.options
        near_m = max(options.corridor_m or 0.0, 2.0 * options.profile().position_m(1))
        return state is not None and abs(state.position_m - position_m) <= near_m

    # Arming -----------------------------------------------------------------------------------------------------------

    def _check(self, limits: Limits) -> None:
        """Raise GuardRefusesError where limits and the motor's options contradict each other."""
        options, channels = self._motor.options, self.force_stream.channels
        missing = [name for name in MANDATORY if getattr(options, name) is None]
        if missing:
            raise GuardRefusesError(
                f"The rig file does not state the motor's {', '.join(missing)}.", hint="See docs/hardware.md, Safety."
            )
        assert options.lower_m is not None
        assert options.upper_m is not None
        assert options.speed_m_s is not None
        assert options.corridor_m is not None
        low, high = limits.travel_m
        here_m = options.home_m if options.homing == "here" else limits.retreat_m
        for wrong, problem in (
            (not options.lower_m <= low < high <= options.upper_m, "the travel is not within the drive's ends"),
            (options.retreat_m != limits.retreat_m, "retreat_m is not the drive's"),
            (options.retreat_speed_m_s != limits.retreat_speed_m_s, "retreat_speed_m_s is not the drive's"),
            (options.speed_m_s > limits.speed_m_s, "the drive's speed is above the limit"),
            (self._steps(limits.step_m) == 0, "a step is shorter than half an increment of the drive"),
            (options.corridor_m > limits.step_m, "the drive's corridor is longer than a step"),
            (abs(here_m - limits.retreat_m) > options.corridor_m, "homed here, the motor must stand at retreat_m"),
            (len(limits.zero) != len(channels), f"the force has {len(channels)} channels and {len(limits.zero)} zeros"),
            (
                limits.torque_ceiling_nm is not None and not any(channel.kind == "torque" for channel in channels),
                "there is a ceiling of torque and no torque",
            ),
            (self._force_lost or self._motor_lost, "a device is gone: close the guard and open a new one"),
        ):
            if wrong:
                raise GuardRefusesError(f"The guard does not arm: {problem}.", hint="See docs/hardware.md, Safety.")

    def _wait_for_force(self, careful: Limits) -> None:
        """Watch the unloaded force for a while; raises GuardRefusesError."""
        before = -1
        while self._seen_force.received != before:  # what has waited since nobody looked
            before = self._seen_force.received
            self._take_force(0.0, None)
        problem: Problem | None = None
        until_ns = self._clock() + round(1e9 * ALIVE_S)
        # A first sample may be as far away as its age may be.
        self._take_force(careful.force_age_s, None)
        while problem is None and self._clock() < until_ns:
            problem = self._take_force(LOOK_S, careful)
            self._take_motor(0.0, None)
        if problem is not None:
            raise GuardRefusesError(
                f"The guard does not arm: {problem[0]}: {problem[1]}.",
                hint="Unload the force sensor, take its zero anew, and check its cable.",
            )

    def _home(self, careful: Limits) -> None:
        """Home the motor under watch; raises GuardRefusesError, MotorError, LinkError."""
        problem: Problem | None = None

        def stop() -> bool:
            nonlocal problem
            problem = problem or self._take_force(0.0, careful)
            if problem is None and self._interrupted():
                problem = Trigger.TERMINATED, "interrupted"
            return problem is not None

        self._tell(None, "homing")
        try:
            self._motor.home(stop)
        except (MotorError, LinkError) as error:
            self._homing_failed(*(problem or (Trigger.HOMING, error.message)))

    def _retract(self, careful: Limits) -> None:
        """Go to the place of retreat under watch; raises as `_home`."""
        deadline_ns = self._clock() + round(1e9 * careful.retreat_s)
        self._motor.retreat()
        sent_ns = self._clock()
        while True:
            problem = self._seen(LOOK_S, careful)
            state = self._motor.state
            if problem is None and self._interrupted():
                problem = Trigger.TERMINATED, "interrupted"
            if problem is None and self._clock() > deadline_ns:
                problem = Trigger.HOMING, "the motor has not come to retreat_m in its time"
            if problem is not None:
                with suppress(TactbenchError):
                    self._motor.halt()
                self._homing_failed(*problem)
            if not self._motor.moving and state is not None and state.t_ns > sent_ns and self._at(careful.retreat_m):
                self._end_sequence = self._seen_force.sequence
                return

    def _homing_failed(self, trigger: Trigger, text: str) -> NoReturn:
        self.state, self.trigger, self._home_anew = GuardState.FAULT, Trigger.HOMING, True
        self._tell(Trigger.HOMING, f"{trigger}: {text}")
        raise GuardRefusesError(
            f"The motor stands where it was homed or retracted: {trigger}: {text}",
            hint="See what the indenter touches; then disarm, and arm again.",
        )

    # Telling ----------------------------------------------------------------------------------------------------------

    def _tell(self, trigger: Trigger | None, text: str) -> None:
        watch, state = self._watch, self._motor.state
        event = Event(
            t_ns=self._clock(),
            state=self.state,
            trigger=trigger,
            force_n=math.nan if watch is None else watch.force_n,
            position_m=math.nan if state is None else state.position_m,
            text=text,
            values={} if watch is None else {"norm_n": watch.norm_n, "force_age_s": watch.age_s(self._clock())},
        )
        self._events.append(event)
        self._reports.append(f"{1e-9 * event.t_ns:.3f} s: {'' if trigger is None else f'{trigger}: '}{text}")
        self._on_event(event)

    def _report(self, sequence: int, verdict: _Verdict) -> Report:
        watch, state = self._seen_force, self._motor.state
        reports, self._reports = self._reports, []
        return Report(
            sequence=sequence,
            t_ns=self._clock(),
            state=self.state,
            accepted=verdict.accepted,
            reason=verdict.reason,
            early=verdict.early,
            moving=self._motor.moving,
            position_m=math.nan if state is None else state.position_m,
            position_t_ns=0 if state is None else state.t_ns,
            target_m=math.nan if state is None else state.target_m,
            force_n=watch.force_n,
            force_sequence=watch.sequence,
            force_t_ns=watch.t_ns,
            touched=self._touched,
            trigger=self.trigger,
            not_out=self._not_out,
            event="; ".join(reports),
        )

"""One press as a state machine, advanced in each control period by the guard's report; its code never waits.

::

    approach -> contact -> lift -> unloaded -> return -> ramp -> unload -> done
    any of them -> retreat -> failed

The surface is found first: a fast move to a place above it, a slow move until the raw force shows a touch, then a small
force for a while. Then the motor lifts the indenter off for the scene's unloaded hold, returns, and follows the force
profile. Touch is detected on the raw force; the force is regulated on the filtered one. The guard checks the
raw force independently, and retreats independently.

Place and force must agree (derived; k is a stiffness, x a way into the skin):

- before the surface can be reached the mean force is zero; the touch comes at the latest where the softest declared
  skin is; after lifting off the mean force is zero again;
- on the ramp, x further in than at any place since the touch, the mean force has grown by softest k x to stiffest k x,
  but for twice the largest mean without touch, which is above the noise of a mean. So a force sensor that no longer
  responds is detected after 2 mean/softest k.

A wrong scale of the force is inside these limits: only the check of the force chain finds it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from statistics import fmean

from tactbench.devices.force_loop import ForceController, ForceLaw
from tactbench.devices.guard_messages import Beat, CommandKind, GuardState, Report

OFF_S = 1.0
"""Longest time of the force outside the error band [s], less half of the time inside, so that oscillations count."""
OFF_SKIN_S = 2.0
"""Longest time from lifting off until the mean force is zero [s]: a skin recovers slowly (assumed)."""
MOST_PERIODS = 3
"""Largest number of control periods in one step of the force law after the program was held up."""


class PressState(StrEnum):
    """State of a press, in the usual order."""

    APPROACH = "approach"
    """Moving towards the skin until it is touched."""
    CONTACT = "contact"
    """In contact, holding a small force."""
    LIFT = "lift"
    UNLOADED = "unloaded"
    """At rest just above the skin, for the scene's unloaded hold."""
    RETURN = "return"
    RAMP = "ramp"
    UNLOAD = "unload"
    DONE = "done"
    """Ended: just above the skin again."""
    RETREAT = "retreat"
    FAILED = "failed"
    """Ended: the motor has retreated; :attr:`Press.ended` is the reason."""


@dataclass(frozen=True)
class PressPlan:
    """The numbers of all presses of a rig, in m, N and s."""

    law: ForceLaw
    """The force law, with lengths in m."""
    resolution_m: float
    """Resolution of the axis: shorter steps are not sent, but added to later steps."""
    step_m: float
    """Largest increment in one control period."""
    near_m: float
    """Position above any possible surface, at which the axis slows down to `touch_speed_m_s`."""
    found_m: float
    """Position below any possible surface, at which even the softest skin must have been touched."""
    speed_m_s: float
    """Speed of the approach down to `near_m`."""
    touch_speed_m_s: float
    """Speed from `near_m` until the touch."""
    unload_speed_m_s: float
    mean_n: float
    """Largest mean of the newest `mean_count` raw forces that is no touch; the guard itself tests single forces."""
    mean_count: int
    softest_n_m: float
    """Least stiffness of any skin from the touch on: force per way into the skin."""
    stiffest_n_m: float
    """Greatest stiffness of any skin: force per way into the skin."""
    contact_n: float
    """Force held after the touch until the surface is known, and least force on the ramp."""
    settle_s: float
    """Time for which `contact_n` is held."""
    lift_m: float
    """Way back from the contact for the unloaded hold."""
    error_band_n: float
    """Largest difference of filtered and wanted force; the press ends after `OFF_S` of larger differences."""


@dataclass(frozen=True)
class Course:
    """Force profile of a scene."""

    setpoint_n: Callable[[float], float]
    """Function from the time since the scene's first sample [s] to the wanted force [N]."""
    slope_n_s: float
    """Slope of the ramp [N/s]."""
    ramp_s: float
    """Time at which the ramp begins [s]."""
    end_s: float
    """Time at which the ramp ends [s]."""


class Press:
    """Press of one scene, from approach to unloading.

    Parameters
    ----------
    plan
        Numbers of the rig for a press.
    course
        Force profile of the scene.

    Attributes
    ----------
    state
        State of the press.
    ended
        Reason of the failure; empty: no failure.
    not_out
        Instruction to an operator if the motor has not retreated; empty: no instruction.
    contact_m
        Position of the motor under the small contact force [m]; NaN: not reached yet.
    touch_n
        Largest raw force [N] from the first touch until `contact_m` was known.
    """

    def __init__(self, plan: PressPlan, course: Course) -> None:
        self.state = PressState.APPROACH
        self.ended = ""
        self.not_out = ""
        self.contact_m = math.nan
        self.touch_n = 0.0
        self.setpoint_n = 0.0
        self._plan, self._course = plan, course
        self._raw: deque[float] = deque(maxlen=plan.mean_count)
        self._places: deque[float] = deque(maxlen=plan.mean_count)
        self._way: list[tuple[float, float, float]] = []
        self._force_n = math.nan
        self._controller: ForceController | None = None
        self._stepped_s = 0.0
        self._since_s = 0.0
        self._began_s: float | None = None
        self._off_s = self._standing_s = 0.0
        self._goal: Beat | None = None
        self._requested_s: float | None = None
        self._move(plan.near_m, plan.speed_m_s)

    # Calls of a rig ---------------------------------------------------------------------------------------------------

    @property
    def ready(self) -> bool:
        """True if the surface is found and the scene may begin."""
        return self.state is PressState.UNLOADED

    @property
    def over(self) -> bool:
        """True if the press has ended."""
        return self.state in (PressState.DONE, PressState.FAILED)

    def begin(self, now_s: float) -> None:
        """Let the scene begin: its time counts from `now_s`."""
        self._began_s = now_s

    def fail(self, why: str) -> None:
        """Let the motor retreat for a reason; of several reasons the first is kept."""
        if not self.over and self.state is not PressState.RETREAT:
            self.ended = why
            self._enter(PressState.RETREAT, self._since_s)

    def abandon(self) -> None:
        """End the press without a retreat, when no more steps follow."""
        if not self.over:
            self._enter(PressState.FAILED, self._since_s)

    # Stepping ---------------------------------------------------------------------------------------------------------

    def step(self, report: Report, raw: Sequence[float], now_s: float) -> Beat:
        """Advance the press by one control period; return the beat for the guard.

        Parameters
        ----------
        report
            Last report of the guard.
        raw
            Raw pressing forces [N] since the last step, less the zero.
        now_s
            Time of the rig's clock [s].
        """
        self._take(raw, report.position_m)
        if report.state in (GuardState.RETREATING, GuardState.RETREATED, GuardState.FAULT):
            return self._guarded(report, now_s)
        match self.state:
            case PressState.APPROACH:
                return self._approach(report, now_s)
            case PressState.LIFT | PressState.RETURN | PressState.UNLOAD:
                self._on_the_way(report, now_s)
            case PressState.UNLOADED:
                if self._began_s is not None and now_s - self._began_s >= self._course.ramp_s:
                    self._enter(PressState.RETURN, now_s)
                    self._move(self.contact_m, self._plan.touch_speed_m_s)
            case PressState.CONTACT | PressState.RAMP:
                return self._regulated(report, now_s)
            case PressState.RETREAT:
                return Beat(command=CommandKind.RETREAT)
        return self._pending(report, now_s)

    def _take(self, raw: Sequence[float], position_m: float) -> None:
        """Store the newest raw forces, the axis' position, and the largest force of the touch."""
        self._raw.extend(raw)
        self._places.extend([position_m] * len(raw))
        if raw:
            self._force_n = raw[-1]
        if self.state in (PressState.APPROACH, PressState.CONTACT):
            self.touch_n = max(self.touch_n, *raw, 0.0)

    @property
    def mean_n(self) -> float:
        """Mean of the newest `mean_count` raw forces [N]; NaN: fewer received so far."""
        return fmean(self._raw) if len(self._raw) == self._raw.maxlen else math.nan

    def _guarded(self, report: Report, now_s: float) -> Beat:
        if self.state is not PressState.RETREAT and not self.over:
            self.ended = f"in {self.state}: {report.trigger or report.state}"
            self._enter(PressState.RETREAT, now_s)
        if report.state is not GuardState.RETREATING and not self.over:
            self.not_out = report.not_out
            self._enter(PressState.FAILED, now_s)
        return Beat()

    def _enter(self, state: PressState, now_s: float) -> None:
        self.state, self._since_s = state, now_s
        self._goal = self._requested_s = None
        self._off_s = self._standing_s = 0.0

    # Moves ------------------------------------------------------------------------------------------------------------

    def _move(self, position_m: float, speed_m_s: float) -> None:
        self._goal = Beat(command=CommandKind.MOVE_TO, position_m=position_m, speed_m_s=speed_m_s)
        self._requested_s = None

    def _pending(self, report: Report, now_s: float) -> Beat:
        """Return the pending move until the guard accepts it."""
        if self._goal is None or self._requested_s is not None or report.moving:
            return Beat()
        self._requested_s = now_s
        return self._goal

    def _arrived(self, report: Report, now_s: float) -> bool:
        """Return True if the last move has ended; a move that was not accepted is sent again."""
        if self._goal is None or self._requested_s is None or now_s <= self._requested_s:
            return False
        if not report.accepted:
            self._requested_s = None
            return False
        return not report.moving

    def _approach(self, report: Report, now_s: float) -> Beat:
        plan, goal = self._plan, self._goal
        if goal is None:  # after a touch
            if not report.moving:
                self._begin_loop(PressState.CONTACT, report, now_s)
            return Beat()
        slowly, mean_n = goal.position_m == plan.found_m, self.mean_n
        begun = self._requested_s is not None
        touched = begun and (report.touched or mean_n > plan.mean_n)
        if not slowly and (touched or mean_n < -plan.mean_n):
            read_n = report.force_n if report.touched else mean_n
            at_mm, near_mm = 1e3 * report.position_m, 1e3 * plan.near_m
            self.fail(
                f"the force reads {read_n:.2f} N at {at_mm:.3f} mm, before any surface, at {near_mm:.3f} mm: "
                "something is in the way, the motor's position is wrong, or the zero was taken under load"
            )
        elif touched:
            self._goal = None
            # The guard has halted the axis at single forces; at a mean it is halted from here.
            return Beat(command=CommandKind.NONE if report.touched else CommandKind.STOP)
        elif self._arrived(report, now_s):
            if not slowly:
                self._move(plan.found_m, plan.touch_speed_m_s)
            else:
                self.fail(f"no touch down to {1e3 * report.position_m:.3f} mm, below the surface of the rig file")
        return self._pending(report, now_s)

    def _on_the_way(self, report: Report, now_s: float) -> None:
        """Enter the next state at the end of a move; when returning to the skin, also at a touch."""
        if not (self._arrived(report, now_s) or (self.state is PressState.RETURN and report.touched)):
            return
        if report.moving:
            return
        if self.state is PressState.RETURN:
            self._begin_loop(PressState.RAMP, report, now_s)
            return
        if not self._standing_s:
            self._standing_s = now_s
            self._raw.clear()
        if abs(self.mean_n) < self._plan.mean_n:
            self._enter(PressState.UNLOADED if self.state is PressState.LIFT else PressState.DONE, now_s)
        elif now_s > self._standing_s + OFF_SKIN_S and not math.isnan(self.mean_n):
            self.fail(
                f"{self.mean_n:.2f} N are left after lifting off: the zero was taken under load or has drifted, or the "
                "indenter is not off"
            )

    # Under force ------------------------------------------------------------------------------------------------------

    def _begin_loop(self, state: PressState, report: Report, now_s: float) -> None:
        self._enter(state, now_s)
        # The noise of a single sample would be a step at the input of the filter.
        force_n = self._force_n if math.isnan(self.mean_n) else self.mean_n
        self._controller, self._stepped_s = ForceController(self._plan.law, force_n, report.position_m), now_s
        self._raw.clear()
        self._places.clear()

    def _setpoint(self, now_s: float) -> tuple[float, float]:
        least = self._plan.contact_n
        if self.state is PressState.CONTACT or self._began_s is None:
            return least, 0.0
        scene_s = now_s - self._began_s
        setpoint = self._course.setpoint_n(scene_s)
        rising = setpoint > least and scene_s < self._course.end_s
        return max(least, setpoint), self._course.slope_n_s if rising else 0.0

    def _regulated(self, report: Report, now_s: float) -> Beat:
        controller, plan = self._controller, self._plan
        assert controller is not None
        # After a longer standstill the force in between is not known.
        passed_s, self._stepped_s = min(now_s - self._stepped_s, MOST_PERIODS * plan.law.period_s), now_s
        self.setpoint_n, slope = self._setpoint(now_s)
        controller.step(self._force_n, report.position_m, passed_s, self.setpoint_n, slope)
        if self.state is PressState.CONTACT:
            if report.position_m > plan.found_m + plan.step_m:
                self.fail(f"the contact force was not reached down to {1e3 * report.position_m:.3f} mm")
                return Beat(command=CommandKind.RETREAT)
            if now_s - self._since_s >= plan.settle_s:
                self.contact_m = controller.target
                self._enter(PressState.LIFT, now_s)
                self._move(self.contact_m - plan.lift_m, plan.touch_speed_m_s)
                return self._pending(report, now_s)
        elif not self._within_limits(controller.filtered_n, passed_s):
            return Beat(command=CommandKind.RETREAT)
        elif self._began_s is not None and now_s - self._began_s >= self._course.end_s:
            self._enter(PressState.UNLOAD, now_s)
            self._move(self.contact_m - plan.lift_m, plan.unload_speed_m_s)
            return self._pending(report, now_s)
        way = controller.target - report.target_m
        if report.moving or abs(way) < 0.5 * plan.resolution_m:
            return Beat()
        return Beat(command=CommandKind.STEP, distance_m=min(max(way, -plan.step_m), plan.step_m))

    def _within_limits(self, filtered_n: float, passed_s: float) -> bool:
        """Return True if force and position agree with each other and with the setpoint; else let the press fail."""
        plan = self._plan
        self._agree(self.mean_n, fmean(self._places) if self._places else math.nan)
        off = abs(filtered_n - self.setpoint_n) > plan.error_band_n
        self._off_s = max(0.0, self._off_s + (passed_s if off else -0.5 * passed_s))
        if self._off_s >= OFF_S:
            self.fail(f"the force was off the wanted {self.setpoint_n:.2f} N by more than {plan.error_band_n:g} N")
        return not self.ended

    def _agree(self, force_n: float, place_m: float) -> None:
        """Fail unless the force has grown with depth as the declared stiffnesses allow, from each place on this way in.

        `_way` has for each of these places: position; up to there the largest force less the softest skin's, and the
        least force less the stiffest skin's. Force and position are means over the same time.
        """
        plan, way = self._plan, self._way
        if math.isnan(force_n) or place_m < self.contact_m:
            return
        while way and way[-1][0] >= place_m:
            way.pop()
        soft_n, stiff_n = force_n - plan.softest_n_m * place_m, force_n - plan.stiffest_n_m * place_m
        _, most_n, least_n = way[-1] if way else (place_m, soft_n, stiff_n)
        lacking = "less than on the softest declared skin: contact was lost, or the force sensor does not respond"
        excessive = "more than on the stiffest declared skin: the zero drifts, or something else is touched"
        for wrong_n, text in ((most_n - soft_n, lacking), (stiff_n - least_n, excessive)):
            if wrong_n > 2 * plan.mean_n:
                self.fail(f"{force_n:.2f} N at {1e3 * place_m:.3f} mm are {wrong_n:.2f} N {text}")
        way.append((place_m, max(most_n, soft_n), min(least_n, stiff_n)))

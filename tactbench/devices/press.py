"""One press as a state machine, stepped once a control period with the guard's report; it never waits.

::

    approach -> contact -> lift -> unloaded -> return -> ramp -> unload -> done
    any of them -> retreat -> failed

The surface is found first: a quick move to a place above it, a slow one until the raw force shows a touch, then a small
force for a while. From there the motor lifts the indenter off for the scene's unloaded hold, returns, and follows the
scene's profile. Touch is detected on the raw force; the force is regulated on the filtered one. The guard checks the
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
"""Longest time of the force outside the error band, less half of the time inside it, so that a swing counts."""
OFF_SKIN_S = 2.0
"""Longest time from lifting off until the mean force is zero: a skin recovers (assumed)."""
MOST_PERIODS = 3
"""Most periods that a step of the force law counts where the program stood still."""


class PressState(StrEnum):
    """State of a press."""

    APPROACH = "approach"
    """Until the skin is touched."""
    CONTACT = "contact"
    """Under a small force."""
    LIFT = "lift"
    UNLOADED = "unloaded"
    """Just above the skin, for the scene's unloaded hold."""
    RETURN = "return"
    RAMP = "ramp"
    UNLOAD = "unload"
    DONE = "done"
    """Just above the skin again."""
    RETREAT = "retreat"
    FAILED = "failed"
    """The motor is out; :attr:`Press.ended` is the reason."""


@dataclass(frozen=True)
class PressPlan:
    """The numbers of a press, in m, N and s."""

    law: ForceLaw
    """The force law, in m."""
    resolution_m: float
    """Resolution of the axis: shorter steps are not sent, and added to later ones."""
    step_m: float
    """Largest increment of a control period."""
    near_m: float
    """Place above any surface, at which the axis changes to the speed of touching."""
    found_m: float
    """Place below any surface, until which the softest skin must have been touched."""
    speed_m_s: float
    """Speed to `near_m`."""
    touch_speed_m_s: float
    """Speed from there on."""
    unload_speed_m_s: float
    mean_n: float
    """Largest mean of the newest `mean_count` raw forces without touch; the guard halts at single forces."""
    mean_count: int
    softest_n_m: float
    """Least force per way into any skin, from the touch on."""
    stiffest_n_m: float
    """Greatest force per way into any skin."""
    contact_n: float
    """Force after the touch until the surface is known; and the least force on the ramp."""
    settle_s: float
    """Time under that force."""
    lift_m: float
    """Way back from there for the unloaded hold."""
    error_band_n: float
    """Largest difference of the filtered force from the wanted one; the press ends after `OFF_S` beyond it."""


@dataclass(frozen=True)
class Course:
    """Force profile of a scene."""

    setpoint_n: Callable[[float], float]
    """Function from a second since the scene's first sample to the force."""
    slope_n_s: float
    """Slope of the ramp."""
    ramp_s: float
    """Second at which the ramp begins."""
    end_s: float
    """Second at which it ends."""


class Press:
    """One press of one scene.

    Parameters
    ----------
    plan
        Numbers of the rig.
    course
        Force profile of the scene.

    Attributes
    ----------
    state
        State of the press.
    ended
        Reason of the failure; empty: none.
    not_out
        Instruction to an operator where the motor did not come out; empty: it did.
    contact_m
        Position of the motor under the small force; NaN: not reached yet.
    touch_n
        Largest raw force from the first touch until that position was known.
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
        """Whether the surface is found, and the scene may begin."""
        return self.state is PressState.UNLOADED

    @property
    def over(self) -> bool:
        """Whether the press has ended."""
        return self.state in (PressState.DONE, PressState.FAILED)

    def begin(self, now_s: float) -> None:
        """Let the scene begin: its seconds count from now on."""
        self._began_s = now_s

    def fail(self, why: str) -> None:
        """Let the motor retreat for a reason; the first one is kept."""
        if not self.over and self.state is not PressState.RETREAT:
            self.ended = why
            self._enter(PressState.RETREAT, self._since_s)

    def abandon(self) -> None:
        """End the press without a retreat: it is not stepped any longer."""
        if not self.over:
            self._enter(PressState.FAILED, self._since_s)

    # Stepping ---------------------------------------------------------------------------------------------------------

    def step(self, report: Report, raw: Sequence[float], now_s: float) -> Beat:
        """Go on by one control period.

        Parameters
        ----------
        report
            Last answer of the guard.
        raw
            Raw pressing forces [N] since the last step, less the zero.
        now_s
            Second of the rig's clock.
        """
        self._take(raw, report.position_m)
        if report.state in (GuardState.RETREATING, GuardState.RETREATED, GuardState.FAULT):
            return self._guarded(report, now_s)
        match self.state:
            case PressState.APPROACH:
                self._approach(report, now_s)
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
        """Store the newest raw forces with the place of the axis, and the largest force of a touch."""
        self._raw.extend(raw)
        self._places.extend([position_m] * len(raw))
        if raw:
            self._force_n = raw[-1]
        if self.state in (PressState.APPROACH, PressState.CONTACT):
            self.touch_n = max(self.touch_n, *raw, 0.0)

    @property
    def mean_n(self) -> float:
        """Mean of the newest `mean_count` raw forces [N]; NaN: fewer have come yet."""
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
        """Return the pending move, until the guard has accepted it; a stop at once."""
        if self._goal is None or self._requested_s is not None:
            return Beat()
        if report.moving and self._goal.command is not CommandKind.STOP:
            return Beat()
        self._requested_s = now_s
        return self._goal

    def _arrived(self, report: Report, now_s: float) -> bool:
        """Return whether the last move is over; one that was not accepted is sent again."""
        if self._goal is None or self._requested_s is None or now_s <= self._requested_s:
            return False
        if not report.accepted:
            self._requested_s = None
            return False
        return not report.moving

    def _approach(self, report: Report, now_s: float) -> None:
        plan, goal = self._plan, self._goal
        if goal is None or goal.command is CommandKind.STOP:  # standing after a touch
            if not report.moving and (goal is None or self._requested_s is not None):
                self._begin_loop(PressState.CONTACT, report, now_s)
            return
        slowly, mean_n = goal.position_m == plan.found_m, self.mean_n
        begun = self._requested_s is not None
        touched = begun and (report.touched or mean_n > plan.mean_n)
        if not slowly and (touched or mean_n < -plan.mean_n):
            read_n = report.force_n if report.touched else mean_n
            at_mm, near_mm = 1e3 * report.position_m, 1e3 * plan.near_m
            self.fail(
                f"the force reads {read_n:.2f} N at {at_mm:.3f} mm, before {near_mm:.3f} mm, where the surface can be: "
                "something is in the way, the motor's place is wrong, or the zero was taken under load"
            )
        elif touched:
            # The guard has halted the axis at single forces; at a mean it is halted from here.
            self._goal = None if report.touched else Beat(command=CommandKind.STOP)
            self._requested_s = None
        elif self._arrived(report, now_s):
            if not slowly:
                self._move(plan.found_m, plan.touch_speed_m_s)
            else:
                self.fail(f"no touch down to {1e3 * report.position_m:.3f} mm, where the surface is by the rig file")

    def _on_the_way(self, report: Report, now_s: float) -> None:
        """Enter the next state at the end of a move; on the way back to the skin also at a touch."""
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
                self.fail(f"the force kept after the touch is not found down to {1e3 * report.position_m:.3f} mm")
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
        """Return whether force and place are within their limits; fail else."""
        plan = self._plan
        self._agree(self.mean_n, fmean(self._places) if self._places else math.nan)
        off = abs(filtered_n - self.setpoint_n) > plan.error_band_n
        self._off_s = max(0.0, self._off_s + (passed_s if off else -0.5 * passed_s))
        if self._off_s >= OFF_S:
            self.fail(f"the force was off by more than {plan.error_band_n:g} N, at {self.setpoint_n:.2f} N")
        return not self.ended

    def _agree(self, force_n: float, place_m: float) -> None:
        """Fail unless the force has grown with the way as declared skins allow, from every place on this way in.

        `_way` has for each of these places: the place, and over it and those before the largest force above the softest
        skin's, and the least above the stiffest's. Force and place are means of the same time.
        """
        plan, way = self._plan, self._way
        if math.isnan(force_n) or place_m < self.contact_m:
            return
        while way and way[-1][0] >= place_m:
            way.pop()
        soft_n, stiff_n = force_n - plan.softest_n_m * place_m, force_n - plan.stiffest_n_m * place_m
        _, most_n, least_n = way[-1] if way else (place_m, soft_n, stiff_n)
        lacking = "less than on the softest declared skin: contact is lost, or the force sensor does not respond"
        excessive = "more than on the stiffest declared skin: the zero drifts, or something else is touched"
        for wrong_n, text in ((most_n - soft_n, lacking), (stiff_n - least_n, excessive)):
            if wrong_n > 2 * plan.mean_n:
                self.fail(f"{force_n:.2f} N at {1e3 * place_m:.3f} mm are {wrong_n:.2f} N {text}")
        way.append((place_m, max(most_n, soft_n), min(least_n, stiff_n)))

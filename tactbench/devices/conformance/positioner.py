"""Checks of an axis' driver on its emulator in virtual time: the driver's position is compared with the emulator's."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tactbench.core.conformance.check import Subject, check, fail, skip
from tactbench.devices.conformance.driver import Opened, emulated
from tactbench.devices.positioner import NotReadyError, Positioner

PLACES = {"home_m": -4e-3, "lower_m": -4e-3, "upper_m": 4e-3, "retreat_m": -3e-3}
PACE = {"speed_m_s": 5e-3, "acceleration_m_s2": 1.0, "corridor_m": 2e-5, "retreat_speed_m_s": 5e-3}
"""Default options of the axis, used if `emulated_options` of its descriptor lack them; homing finds the lower end."""
HOMING_S, MOVE_S = 120.0, 2.0  # timeouts (assumed: 100 mm at 1 mm/s, and back); a long axis is moved over a part of it
LOOK_S, REST_S = 1e-3, 0.3  # time between two looks at a moving axis; time for which it must stand after a move


class _Axis(Opened):
    """A started axis with its emulator, whose position is the true one."""

    def true_m(self) -> float:
        """Return the emulated axis' true position [m]."""
        return float(self.emulator.position_m)

    def stretch(self) -> tuple[float, float]:
        """Return the ends [m] of a part of the travel with the present position, at most a move of `MOVE_S` long."""
        (low, high), speed = self.driver.facts.limits, self.driver.facts.speed
        length = min(high - low, MOVE_S * speed)
        begin = min(max(low, self.driver.position), high - length)
        return begin, begin + length

    def update(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Update the driver until the condition `until` is true, at most for `seconds`."""
        end_ns = self.clock() + round(1e9 * seconds)
        while not until() and (before_ns := self.clock()) < end_ns:
            self.call("update", LOOK_S)
            if self.clock() == before_ns:
                self.wait(LOOK_S)

    def ended(self, what: str, target_m: float, seconds: float) -> None:
        """Wait for the end of a move; fail unless axis and driver then report its target [m], and remain there."""
        began_m = self.true_m()
        self.update(seconds, lambda: not self.driver.moving)
        there_m = self.true_m()
        self.update(REST_S)
        for where, at_m in ((what, there_m), (what, self.true_m()), ("driver.position", self.driver.position)):
            if not abs(at_m - target_m) <= self.driver.facts.near:
                turned = (at_m - began_m) * (target_m - began_m) < 0
                guess = ": is the axis' direction reversed?" if turned else ""
                fail(where, f"the axis is at {at_m:.6g} m, expected {target_m:.6g} m{guess}")

    def refused(self, target_m: float, why: str) -> None:
        """Fail unless the driver refuses a move by NotReadyError."""
        before_m = self.true_m()
        try:
            self.call("move_to", target_m)
        except AssertionError as failure:
            if not isinstance(failure.__cause__, NotReadyError):
                raise
            return
        self.update(REST_S)
        moved = f"the axis moves by {1e3 * (self.true_m() - before_m):.3g} mm"
        fail("driver.move_to", f"accepts a move to {target_m:g} m {why}; {moved}: call check_move() before sending")


@contextmanager
def _axis(subject: Subject, *, homed: bool = True) -> Iterator[_Axis]:
    kind = subject.code("driver")
    if not (isinstance(kind, type) and issubclass(kind, Positioner)):
        skip("the driver is not a Positioner, so it moves no axis")
    own = subject.descriptor.emulated_options
    places = PLACES if own.keys().isdisjoint(PLACES) else {}
    given = {name: value for name, value in {**places, **PACE}.items() if name not in own}
    with emulated(subject, of_both=given) as opened:
        if not hasattr(opened.emulator, "position_m"):
            fail("emulator", "the emulator lacks `position_m`, the axis' position [m] as its driver counts")
        axis = _Axis(*opened)
        if homed:
            _home(axis)
        yield axis


def _home(axis: _Axis) -> None:
    until_ns = axis.clock() + round(1e9 * HOMING_S)
    axis.call("home", lambda: axis.clock() > until_ns)
    if not axis.driver.enabled:
        axis.call("enable")


@check("device", needs="driver-reads")
def axis_is_homed(subject: Subject) -> None:
    """Before homing the position is unknown; force ceiling, ends of travel and retreat all depend on the home.

    State resolution_m and stop_latency_s; refuse moves by check_move() until home() has set `homed`; count the place
    found by homing as `home_m`; let home() return only when the axis stands still.
    """
    with _axis(subject, homed=False) as axis:
        facts = axis.driver.facts
        if not (facts.resolution > 0 and facts.stop_latency_s >= 0 and facts.limits[0] < facts.limits[1]):
            fail("driver.facts", f"state resolution, stop latency and both ends of travel; given are {facts}")
        if not axis.driver.homed:
            axis.refused(sum(facts.limits) / 2, "before the axis is homed")
        _home(axis)
        axis.ended("driver.home", axis.driver.position, facts.seconds(0.0, facts.speed))


@check("device", needs="axis-is-homed")
def axis_goes_where_it_is_sent(subject: Subject) -> None:
    """A reversed direction, a wrong unit or ignored ends of travel can drive an indenter through a sensor.

    Positions are metres, those of a pressing axis positive into the skin. Call check_move() before sending a move,
    begin() afterwards, and see() with each answer; report the end of a move only when the controller is at the target.
    """
    with _axis(subject) as axis:
        facts = axis.driver.facts
        (low, high), speed = axis.stretch(), facts.speed
        for share in (0.5, 0.8, 0.3):
            target_m = axis.call("move_to", low + share * (high - low))
            axis.refused(target_m, "during another move")
            axis.ended("driver.move_to", target_m, facts.seconds(high - low, speed))
        step_m = 0.05 * (high - low)
        axis.call("move_by", step_m)
        axis.ended("driver.move_by", target_m + step_m, facts.seconds(step_m, speed))
        low, high = facts.limits
        for beyond_m in (low - step_m, high + step_m, math.nan, math.inf):
            axis.refused(beyond_m, f"beyond the ends of travel, {low:g} to {high:g} m")


@check("device", needs="axis-goes-where-it-is-sent")
def axis_halts_and_retreats(subject: Subject) -> None:
    """The largest force depends on the way to a stop, which is computed from `stop_latency_s` and acceleration.

    Let halt() and retreat() replace a move under way within the latency that the axis states; state a longer latency
    if the controller needs more, or interruptible = False if the controller completes every move.
    """
    with _axis(subject) as axis:
        driver, facts = axis.driver, axis.driver.facts
        if not facts.interruptible:
            skip("the axis states that its moves cannot be interrupted")
        (low, high), v = axis.stretch(), facts.speed
        most_m = v * (facts.stop_latency_s + 2 * LOOK_S) + v**2 / (2 * facts.acceleration) + facts.near
        for name, goal_m in (("halt", high), ("halt", low), ("retreat", high)):
            start_m = low + 0.5 * (high - low)
            axis.call("move_to", start_m)
            axis.ended("driver.move_to", start_m, facts.seconds(high - low, v))
            way = math.copysign(1.0, goal_m - start_m)
            axis.call("move_to", goal_m)
            axis.update(MOVE_S, lambda: way * (axis.true_m() - start_m) > 0.2 * (high - low))  # noqa: B023  (waited for here)
            stays, furthest = name == "halt" or math.isnan(facts.retreat), [way * axis.true_m()]
            axis.call(name)
            seconds = facts.seconds(facts.limits[1] - facts.limits[0], min(v, facts.retreat_speed))
            # The condition is looked at in each step of the wait.
            axis.update(seconds, lambda: furthest.append(way * axis.true_m()) or not driver.moving)  # type: ignore[func-returns-value]  # noqa: B023
            if (on_m := max(furthest) - furthest[0]) > most_m:
                text = f"the axis goes on by {1e3 * on_m:.3g} mm, at most {1e3 * most_m:.3g} mm follow"
                fail(f"driver.{name}", f"{text} from its stated stop latency and acceleration")
            axis.ended(f"driver.{name}", axis.true_m() if stays else facts.retreat, seconds)

"""The states of a press on a simulated spring, also when its loop swings."""

import math
import re

import pytest

from tactbench.devices.guard_messages import Report
from tactbench.devices.press import PressState
from tactbench.plugin import ChannelSpec, StreamSpec
from tactbench.plugin.devices import CommandKind, Course, GuardState, Press
from tactbench.rigs.parallel_manipulator.settings import settings_of
from tests.rigs.parallel_manipulator.spring import file_of

PERIOD_S = 0.02
FORCE = StreamSpec(
    name="force_torque", rate_hz=1 / PERIOD_S, channels=(ChannelSpec(name="fz", kind="force", unit="N"),)
)
SETTINGS = settings_of(file_of(settings__force_loop__integral_mm_n_s=1.0))
COURSE = Course(setpoint_n=lambda s: min(max(0.0, s - 0.5), 3.0), slope_n_s=1.0, ramp_s=0.5, end_s=3.5)


class Plant:
    """A motor that follows its target at its speed, a guard that accepts all commands, and a spring of 5 N/mm."""

    def __init__(self, settings=SETTINGS):
        self.press = Press(settings.press_plan(1e-6, FORCE), COURSE)
        self.settings = settings
        self.skin_m = settings.surface_m
        self.now_s, self.position_m = 0.0, 1e-3 * settings.limits.retreat_mm
        self.target_m, self.speed_m_s = self.position_m, 0.0
        self.state, self.touched = GuardState.ARMED, False
        self.seen, self.largest_n, self.steps = [], 0.0, []

    @property
    def force_n(self):
        return 5e3 * max(0.0, self.position_m - self.skin_m)

    def report(self):
        moving = self.position_m != self.target_m
        return Report(
            round(1e9 * self.now_s), self.state, moving=moving, position_m=self.position_m, target_m=self.target_m,
            force_n=self.force_n, touched=self.touched,
        )  # fmt: skip

    def go(self):
        """Go on by one control period."""
        command = self.press.step(self.report(), [self.force_n], self.now_s)
        match command.command:
            case CommandKind.MOVE_TO:
                self.target_m, self.speed_m_s, self.touched = command.position_m, command.speed_m_s, False
            case CommandKind.STEP:
                self.steps.append(command.distance_m)
                self.target_m = self.position_m = self.position_m + command.distance_m
            case CommandKind.STOP:
                self.target_m = self.position_m
            case CommandKind.RETREAT:
                self.state = GuardState.RETREATED
        way = self.target_m - self.position_m
        self.position_m += math.copysign(min(abs(way), self.speed_m_s * PERIOD_S), way)
        if way > 0 and self.force_n > self.settings.touch.single_n and command.command is not CommandKind.STEP:
            self.target_m, self.touched = self.position_m, True
        self.now_s += PERIOD_S
        self.largest_n = max(self.largest_n, self.force_n)
        if not self.seen or self.seen[-1] != self.press.state:
            self.seen.append(self.press.state)

    def until(self, *states, seconds=40.0):
        """Continue until the press is in one of the states."""
        end_s = self.now_s + seconds
        while self.press.state not in states:
            assert self.now_s < end_s, self.seen
            self.go()
        return self

    def begun(self):
        """Find the surface, and begin the scene."""
        self.until(PressState.UNLOADED, PressState.FAILED)
        self.press.begin(self.now_s)
        return self


def test_the_states_of_a_press():
    plant = Plant().begun().until(PressState.DONE)
    assert plant.seen == [
        PressState.APPROACH, PressState.CONTACT, PressState.LIFT, PressState.UNLOADED, PressState.RETURN,
        PressState.RAMP, PressState.UNLOAD, PressState.DONE,
    ]  # fmt: skip
    assert plant.press.ended == ""
    assert plant.force_n == 0
    law = SETTINGS.force_loop.law((-1.0, 1.0))
    kept = law.kept(PERIOD_S)
    # The ramp of 1 N/s is behind by r/(k ki) of the integral, less what the filter is (derived); a control period.
    behind_n = 1 / (5e3 * law.integral) - PERIOD_S * kept / (1 - kept)
    assert plant.largest_n == pytest.approx(3.0 - behind_n, abs=PERIOD_S)
    assert max(map(abs, plant.steps)) <= SETTINGS.force_loop.step_m * (1 + 1e-9)
    assert plant.press.contact_m == pytest.approx(plant.skin_m + 0.05 / 5e3, abs=3e-6)


def test_a_loop_that_swings_ends_the_press():
    # Without lag and delay the filtered loop of 2 Hz and 50 Hz settles up to k K T = 16.
    settings = settings_of(file_of(settings__force_loop__integral_mm_n_s=400.0, settings__force_loop__speed_mm_s=50.0,
                                   settings__press__error_band_n=0.3))  # fmt: skip
    plant = Plant(settings).begun().until(PressState.FAILED)
    # Which comes first depends on where the swing has found the surface.
    assert re.search("off the wanted|softest", plant.press.ended)

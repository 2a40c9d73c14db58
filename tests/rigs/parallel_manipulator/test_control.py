"""The loop that beats the guard, in a thread of its own: nobody else uses the guard meanwhile."""

import threading

from tactbench.plugin import ChannelSpec, StreamSpec
from tactbench.plugin.devices import Control, Course, Press
from tactbench.rigs.parallel_manipulator.settings import settings_of
from tests.rigs.parallel_manipulator.presses import FAULTS
from tests.rigs.parallel_manipulator.spring import file_of

FORCE = StreamSpec(name="force_torque", rate_hz=50.0, channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
PLAN = settings_of(file_of()).press_plan(1e-6, FORCE)
COURSE = Course(setpoint_n=lambda s: min(max(0.0, s - 0.5), 3.0), slope_n_s=1.0, ramp_s=0.5, end_s=3.5)


class Asked:
    """A guard that notes which threads use it."""

    def __init__(self, guard):
        self.guard, self.threads = guard, set()

    def __getattr__(self, name):
        self.threads.add(threading.current_thread().name)
        return getattr(self.guard, name)


class Sensor:
    rows = 0

    def __call__(self):
        return self.rows


def armed(sensor, *, stale_s, asked=lambda guard: guard):
    """Return a control of an armed guard, which it asks through `asked`, the world, the guard and what is asked."""
    setting = FAULTS.Setting()
    world = FAULTS.Pressed(setting)
    guard = world.guard()
    guard.start()
    report = guard.arm(setting.limits)
    through, press = asked(guard), Press(PLAN, COURSE)
    control = Control(through, setting.limits, report, press, sensor, world.clock, period_s=0.02, stale_s=stale_s)
    return control, world, guard, through


def test_while_it_runs_counts_are_those_of_its_own_thread():
    control, _, guard, asked = armed(Sensor(), stale_s=1e9, asked=Asked)
    control.start()
    seen, waits = {}, threading.Event()
    for _ in range(1000):
        seen = control.counts
        if seen.get("guard", {}).get("beats", 0) > 20:
            break
        waits.wait(0.01)
    assert seen["guard"]["beats"] > 20
    assert asked.threads == {"force control"}
    control.stop()
    # Of the end, not of a quarter of a second before.
    assert control.counts["guard"]["beats"] == guard.counts["guard"]["beats"]
    guard.close()


def test_a_rig_that_has_hung_does_not_blame_the_sensor():
    sensor = Sensor()
    control, world, guard, _ = armed(sensor, stale_s=0.1)
    for _ in range(10):
        sensor.rows += 1
        control.carry(world.clock() + 20_000_000)
    assert not control.press.over
    guard.advance(world.clock() + 1_000_000_000)
    control.carry(world.clock() + 100_000_000)
    assert "1.0 s" in control.press.ended
    guard.close()

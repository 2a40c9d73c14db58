"""The guard of the linear motor: the same rules in this process and in one of its own, against emulated devices."""

import math
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tactbench.devices.guard_messages import GuardRefusesError, Trigger
from tactbench.plugin import UsageError
from tactbench.plugin.devices import Beat, CommandKind, GuardState, largest_force_n
from tests.rigs.parallel_manipulator.presses import FAULTS, NET_FT, rig

RAISING = "tests.rigs.parallel_manipulator.broken_force:RaisingDriver"


def in_phase(name, change):
    """Return what changes beats once a press has come to a phase."""
    return lambda beat, since_s: change(beat) if beat.state == name else beat


def after(seconds, change):
    return lambda beat, since_s: change(beat) if since_s > seconds else beat


@pytest.fixture
def made(tmp_path):
    with rig("local", tmp_path) as one:
        yield one


@pytest.mark.parametrize("kind", ["local", "process"])
def test_a_press_goes_in_holds_and_comes_out(kind, tmp_path):
    """Through the wire of a guard in another process, too, with what is refused there and what it keeps back."""
    with rig(kind, tmp_path) as made:
        guard, limits = made.guard, made.setting.limits
        with pytest.raises(GuardRefusesError, match="ends"):
            guard.arm(replace(limits, travel_m=(-7e-3, 2e-3)))
        press = made.press()
        assert press.phase == "over", press.reports[-1]
        assert press.reports[-1].state is GuardState.ARMED
        assert made.world.largest_n == pytest.approx(made.setting.setpoint_n, abs=0.3)
        armed_ns = press.reports[0].t_ns
        blocks = [block for block in guard.force_blocks if block.t_ns[0] >= armed_ns]
        numbers = np.concatenate([block.sequence for block in blocks])
        forces = np.concatenate([block.data for block in blocks])
        # Raw and whole: every sample since it was armed, in order, as the sensor gave them.
        assert (np.diff(numbers) == 1).all()
        assert forces.shape[1] == 6
        assert forces[:, 2].max() == pytest.approx(made.world.largest_n, abs=0.05)
        assert np.concatenate([block.data for block in guard.motor_blocks])[:, 0].max() == pytest.approx(
            made.world.largest_n / made.setting.stiffness_n_m, abs=5e-6
        )
        assert [event.text for event in guard.events] == ["started", "homing motor", "armed"]
        assert guard.counts["guard"]["beats"] == press.sequence
        # A rig that takes nothing for long gets its reports: 100 samples, which a full socket holds back.
        before = len(guard.force_blocks)
        guard.advance(made.clock() + round(0.4e9 * limits.heartbeat_s))
        assert guard.beat(Beat(made.clock(), command=CommandKind.STEP, distance_m=math.nan)).reason
        assert len(guard.force_blocks) > before
        assert guard.disarm().state is GuardState.IDLE
        assert made.out


# In virtual time ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "trigger"), [("rig hangs", Trigger.BEAT_OLD), ("steps not numbers", Trigger.COMMANDS_REFUSED)]
)
def test_a_rig_that_goes_wrong(name, trigger, made):
    change = FAULTS.changed({name: 0.0}, made.setting, made.clock)
    made.press(lambda beat, since_s: change(beat, since_s) if beat.state == "ramp" else beat, most_s=3.0)
    report = made.ended()
    assert (report.state, report.trigger) == (GuardState.FAULT, trigger)
    assert made.out
    assert made.world.largest_n < made.setting.allowed_n


def test_a_fault_stays_until_the_guard_is_disarmed_and_armed(made):
    made.press(after(0.2, lambda beat: replace(beat, command=CommandKind.STEP, distance_m=1e-3)))
    report = made.ended()
    assert (report.state, report.trigger) == (GuardState.FAULT, Trigger.COMMANDS_REFUSED)
    with pytest.raises(GuardRefusesError, match="fault"):
        made.guard.arm(made.setting.limits)
    again = made.guard.beat(Beat(made.clock(), command=CommandKind.STEP, distance_m=1e-6))
    assert (again.accepted, again.state) == (False, GuardState.FAULT)
    assert made.guard.disarm().state is GuardState.IDLE
    assert made.press().phase == "over"


def test_a_retreat_that_is_commanded_is_no_fault(made):
    made.press(in_phase("ramp", lambda beat: replace(beat, command=CommandKind.RETREAT)))
    report = made.ended()
    assert (report.state, report.trigger) == (GuardState.RETREATED, Trigger.COMMANDED)
    assert made.out


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"travel_m": (-4e-3, 2e-3)}, "retreat"),
        ({"travel_m": (-7e-3, 2e-3)}, "ends"),
        ({"step_m": 1e-6}, "corridor"),
        ({"zero": (0.0,) * 3}, "3 zeros"),
        ({"zero": (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)}, "while travelling"),
    ],
)
def test_what_is_wrong_before_the_first_motion_is_refused(wrong, message, made):
    before_m = made.world.position_m
    with pytest.raises(GuardRefusesError, match=message):
        made.guard.arm(replace(made.setting.limits, **wrong))
    assert made.world.position_m == pytest.approx(before_m, abs=1e-9)
    assert made.guard.arm(made.setting.limits).state is GuardState.ARMED


@pytest.mark.parametrize(
    ("name", "trigger"),
    [
        ("one sample above the ceiling", Trigger.FORCE_CEILING),
        ("one torque above the ceiling", Trigger.TORQUE_CEILING),
        ("force stuck", Trigger.FORCE_STUCK),
    ],
)
def test_a_force_that_is_wrong(name, trigger, made):
    sensed = FAULTS.sensed({name: 0.0})

    def change(beat):
        made.world.sensed = sensed
        return beat

    made.press(in_phase("ramp", change))
    report = made.ended()
    assert (report.state, report.trigger) == (GuardState.FAULT, trigger)
    assert made.out


def test_an_error_of_a_driver_lets_the_motor_retreat(tmp_path):
    with rig("local", tmp_path, force_driver=RAISING) as made:
        made.press()
        report = made.ended()
        assert (report.state, report.trigger) == (GuardState.FAULT, Trigger.FORCE_LOST)
        assert made.out
        (event,) = [event for event in made.guard.events if event.trigger is Trigger.FORCE_LOST]
        assert event.text.startswith("ZeroDivisionError: ")


def test_what_came_before_it_was_armed_is_not_handed_over_afterwards(made):
    made.guard.advance(made.clock() + 10**9)
    made.guard.arm(made.setting.limits)
    assert not made.guard.force_blocks
    assert not made.guard.motor_blocks


def test_steps_are_sent_one_at_a_time_and_after_a_fresh_force(tmp_path):
    """The step rule, on the motor's line: no increment before the drive has reported the end of the one before."""
    with rig("local", tmp_path, FAULTS.Setting(baud=9600, period_s=5e-3)) as made:
        press = made.press()
        assert press.phase == "over"
        assert any(report.early for report in press.reports)
        accepted = [report for report in press.reports if report.accepted and report.moving]
        line = b"".join(piece for _, piece in made.world.motor.told)
        words = line.split(b"\r")
        moves = [n for n, word in enumerate(words) if word == b"M"]
        assert len(moves) > 20
        # Between two starts the status is asked for: that is how the end of a move is known.
        assert all(b"OST" in words[a:b] for a, b in pairwise(moves))
        assert len(accepted) >= len(moves) - 2


def test_the_ceiling_is_exceeded_by_a_step_at_most(tmp_path):
    setting = FAULTS.Setting(stiffness_n_m=80e3)
    with rig("local", tmp_path, setting) as made:
        made.press(FAULTS.changed({"rig wants 30 N": 0.0}, setting, made.clock), hold_s=2.0)
        report = made.ended()
        assert report.trigger is Trigger.FORCE_CEILING
        assert setting.ceiling_n < made.world.largest_n < setting.allowed_n


def test_a_touch_on_a_fast_approach_ends_it(made):
    def fast_move(beat):
        return beat(command=CommandKind.MOVE_TO, position_m=1e-3, speed_m_s=5e-3)

    reports = []

    def beat(**more):
        due_ns = made.clock() + 20_000_000
        newest = reports[-1].force_sequence if reports else made.guard.beat(Beat(made.clock())).force_sequence
        reports.append(made.guard.beat(Beat(made.clock(), force_sequence=newest, **more)))
        made.guard.advance(due_ns)
        return reports[-1]

    made.guard.arm(made.setting.limits)
    made.guard.advance(made.clock() + 20_000_000)
    assert fast_move(beat).accepted
    while not beat().touched:
        pass
    while beat().moving:
        pass
    # Three samples at most, a look, the line and the braking, all at 5 mm/s and 20 N/mm.
    bound_n = largest_force_n(0.1, 20e3, 5e-3, 1.0, 4e-3 + made.guard._press.facts.stop_latency_s)
    assert 0.1 < made.world.largest_n < bound_n
    assert reports[-1].state is GuardState.ARMED
    # It holds where it was last known to be, which may be out of contact; a step is taken in, a move is not.
    while reports[-1].force_n < 0.1:
        beat(command=CommandKind.STEP, distance_m=made.setting.limits.step_m)
    while beat().moving:
        pass
    refused = fast_move(beat)
    assert not refused.accepted


@pytest.mark.parametrize(
    ("where", "text", "trigger"),
    [
        ("force", "saturated:start_s={0}", Trigger.FORCE_SATURATED),
        ("force", "dropped:start_s={0},end_s={1}", Trigger.FORCE_GAP),
        ("force_link", "late:start_s={0},delay_s=0.014", Trigger.FORCE_OLD),
        ("force_link", "unplug:start_s={0}", Trigger.FORCE_LOST),
        ("motor_link", "unplug:start_s={0}", Trigger.AXIS_LOST),
        ("motor", "motor-fault:start_s={0}", Trigger.AXIS_FAULT),
        ("motor_link", "late:start_s={0}1,delay_s=9", Trigger.AXIS_SILENT),
    ],
    ids=lambda value: str(value).split(":")[0],
)
def test_what_goes_wrong_in_devices_leads_to_a_fault(where, text, trigger, tmp_path):
    from tactbench.devices.emulator import LinkFault

    parse = {"force": FAULTS.DatagramFault, "motor": FAULTS.MotorFault}.get(where, LinkFault).parse
    # The press begins at 0.5 s and lasts for two seconds and a half; five samples are lost.
    with rig("local", tmp_path, **{where: [parse(text.format(1.5, 1.5053))]}) as made:
        made.press()
        report = made.ended(20.0)
        assert (report.state, report.trigger) == (GuardState.FAULT, trigger)
        assert made.out is not (text.startswith(("motor-fault", "unplug")) and where.startswith("motor"))
        events = made.guard.events
        (first,) = [event for event in events if event.trigger is trigger][:1]
        assert 1.5 <= 1e-9 * first.t_ns < 4.0
        assert math.isfinite(first.force_n)
        assert math.isfinite(first.position_m)


def test_a_force_that_does_not_change_lets_no_step_pass(tmp_path):
    # For half a second numbers go on and the value does not; each beat asks for a step, and ten would have their time.
    setting = FAULTS.Setting(period_s=5e-3, same_samples=500)
    with rig("local", tmp_path, setting) as made:
        begun = []

        def push(beat, since_s):
            if beat.state == "ramp" and not begun:
                begun.append(len(press.reports))
                made.world.sensed = FAULTS.sensed({"force stuck": 0.0})
            return replace(beat, command=CommandKind.STEP, distance_m=setting.limits.step_m) if begun else beat

        press = FAULTS.Press(made.guard, setting, made.clock, push)
        last = press.run()
        assert last.trigger is Trigger.FORCE_STUCK
        asked = press.reports[begun[0] :]
        assert len(asked) >= 90
        assert asked[-1].force_sequence >= asked[0].force_sequence + 450
        # One that rested on a sample from before, at most.
        assert sum(report.accepted for report in asked) <= 1


def test_a_drive_that_has_forgotten_its_limits_is_not_armed(made):
    made.press()
    made.guard.disarm()
    made.world.motor.drive.settings["GPL"] = 9999
    with pytest.raises(GuardRefusesError, match="GPL 9999"):
        made.guard.arm(made.setting.limits)


def held(made):
    """Return a change of a beat that ends the press, with something that holds the motor where it is."""

    def block(beat):
        here = made.world.motor.drive.position_m
        made.world.motor.drive.stops = (here - 1e-9, here + 1e-9)
        return replace(beat, t_ns=0)

    return in_phase("ramp", block)


def test_a_motor_that_cannot_come_out_loses_its_power_loudly(made):
    made.press(held(made))
    report = made.ended(5.0)
    assert report.state is GuardState.FAULT
    (event,) = [event for event in made.guard.events if event.trigger is Trigger.RETREAT_FAILED]
    assert report.not_out == event.text
    assert not made.world.motor.drive.enabled


def test_a_motor_that_would_fall_keeps_its_power(tmp_path, monkeypatch):
    fallen = FAULTS.STATED | {"orientation": "vertical", "brake": False, "counterweight": False}
    monkeypatch.setattr(FAULTS, "STATED", fallen)
    with rig("local", tmp_path) as made:
        made.press(held(made))
        report = made.ended(5.0)
        assert report.not_out
        assert made.world.motor.drive.enabled


@pytest.mark.parametrize(("driver", "why"), [(NET_FT, "while travelling"), (RAISING, "motor is at rest")])
def test_force_or_an_error_of_a_driver_while_homing_stops_the_motor(driver, why, tmp_path, monkeypatch):
    # The end stop is 10 mm away, 5 mm behind the skin.
    to_a_stop = {"homing": "end-stop", "homing_speed_m_s": 0.02, "home_m": 5e-3}
    monkeypatch.setattr(FAULTS, "STATED", FAULTS.STATED | to_a_stop)
    with rig("local", tmp_path, force_driver=driver) as made:
        with pytest.raises(GuardRefusesError, match=why):
            made.guard.arm(made.setting.limits)
        assert made.world.largest_n < 0.2 + 20e3 * 0.02 * 20e-3
        assert made.guard.disarm().state is GuardState.IDLE
        here_m = made.world.position_m
        made.guard.advance(made.clock() + 10**9)
        assert made.world.position_m == pytest.approx(here_m, abs=1e-5)


# Out: place and force ------------------------------------------------------------------------------------------------


def test_an_axis_is_homed_where_it_stands_only_after_an_operators_word(made):
    limits, before_m = made.setting.limits, made.world.position_m
    unclear = made.guard.disarm().unclear
    assert unclear.startswith("motor")
    with pytest.raises(GuardRefusesError, match=unclear):
        made.guard.arm(replace(limits, confirmed=False))
    assert made.world.position_m == before_m
    made.guard.arm(limits)
    made.guard.disarm()
    assert made.guard.disarm().unclear == ""
    assert made.guard.arm(replace(limits, confirmed=False)).state is GuardState.ARMED


def test_out_is_place_and_force(made):
    """The count is apart from the place: at its place of retreat there are 3 N left."""
    made.press(in_phase("ramp", lambda beat: replace(beat, command=CommandKind.NONE)), most_s=2.0)
    made.world.sensed = lambda wrench, at_s: [*wrench[:2], wrench[2] + 3.0, *wrench[3:]]
    report = made.guard.disarm()
    assert made.out
    assert re.search(r" 3\.\d\d N", report.not_out)
    (event,) = [event for event in made.guard.events if event.trigger is Trigger.NOT_CLEAR]
    assert event.text == report.not_out
    made.world.sensed = lambda wrench, at_s: wrench
    with pytest.raises(GuardRefusesError, match=re.escape(report.not_out)):
        made.guard.arm(replace(made.setting.limits, confirmed=False))
    assert made.guard.arm(made.setting.limits).not_out == ""


def test_what_is_not_known_to_be_out_is_told_to_the_next_guard(tmp_path):
    kept, limits = tmp_path / "not-out", FAULTS.Setting().limits
    first = FAULTS.Pressed(FAULTS.Setting()).guard(kept=kept)
    first.start()
    first.arm(limits)  # and is killed
    second = FAULTS.Pressed(FAULTS.Setting()).guard(kept=kept)
    second.start()
    assert second.disarm().unclear == kept.read_text(encoding="utf-8")
    with pytest.raises(GuardRefusesError):
        second.arm(replace(limits, confirmed=False))
    second.arm(limits)
    assert kept.exists()
    second.disarm()
    assert not kept.exists()
    second.close()


def test_a_place_that_jumps_ends_the_press_and_is_no_place_to_retreat_from(made):
    begun = []

    def jump(beat):
        if not begun:
            begun.append(made.world.position_m)
            made.world.motor.drive._origin_m += 3e-3
        return beat

    made.press(in_phase("ramp", jump))
    report = made.ended()
    assert (report.state, report.trigger) == (GuardState.FAULT, Trigger.AXIS_FAULT)
    assert not made.guard._press.homed
    assert report.not_out
    # The drive itself runs to its target by the new count, at 20 mm/s, until the ceiling halts it.
    bound_n = largest_force_n(6.0, 20e3, 20e-3, 1.0, 4e-3 + made.guard._press.facts.stop_latency_s)
    assert made.world.largest_n < bound_n


# Schedules ------------------------------------------------------------------------------------------------------------


def test_random_faults_end_as_they_must():
    """A few of the 200 of benchmarks/guard_faults.py."""
    for outcome in FAULTS.schedules(3, 100):
        assert outcome.wrong == (), outcome


@pytest.mark.parametrize(
    "change",
    [
        {"force_ceiling_n": 0.0}, {"force_ceiling_n": math.inf}, {"torque_ceiling_nm": 0.0}, {"touch_n": 7.0},
        {"travel_m": (1e-3, 1e-3)}, {"travel_ceiling_n": 7.0}, {"channel": 6}, {"sign": 0},
    ],
    ids=str,
)  # fmt: skip
def test_limits_that_contradict_each_other(change):
    with pytest.raises(UsageError):
        replace(FAULTS.Setting().limits, **change)

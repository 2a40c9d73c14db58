"""How long the guard takes from a force to the motor's braking, at every baud rate of the table in docs/hardware.md."""

import re
from pathlib import Path

import pytest

from tactbench.rigs.parallel_manipulator.guard import LONGEST_COMMAND, reaction
from tactbench.rigs.parallel_manipulator.guard_interface import Beat, CommandKind, GuardState, Trigger
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions
from tactbench.rigs.parallel_manipulator.motor.retreat import retreat_command
from tests.rigs.parallel_manipulator.presses import FAULTS, rig

PAGE = Path(__file__).parents[3] / "docs" / "hardware.md"
SPEED_M_S = 10e-3


def rows():
    """Return the numbers of the table, a tuple a baud rate."""
    text = PAGE.read_text(encoding="utf-8").split("| baud | T_c |")[1].split("\n\n")[0]
    found = re.findall(r"^\| (\d+) \|(.*)\|$", text, flags=re.MULTILINE)
    return [(int(baud), *(float(cell) for cell in rest.split("|"))) for baud, rest in found]


def options(baud):
    return FaulhaberOptions(**FAULTS.STATED, baud=baud)


def test_the_table_has_the_usual_rates():
    assert [row[0] for row in rows()] == [9600, 19200, 38400, 57600, 115200]


@pytest.mark.parametrize(("baud", "period", "line", "force", "silent", "still", "hangs"), rows())
def test_the_table_says_what_is_computed(baud, period, line, force, silent, still, hangs):
    limits = FAULTS.Setting(baud, period_s=1e-3 * period).limits
    react_ms = 1e3 * reaction(options(baud)).time_s
    on_line_ms = 1e4 * (LONGEST_COMMAND + len(retreat_command(options(baud)))) / baud
    heard_ms = 1e3 * limits.heartbeat_s
    # In ms, with one decimal, a half rounded up.
    assert (line, force) == pytest.approx((on_line_ms, react_ms), abs=0.051)
    assert silent == pytest.approx(1e3 * limits.force_age_s + react_ms, abs=0.051)
    assert still == pytest.approx(limits.same_samples + react_ms, abs=0.051)
    assert hangs == pytest.approx(heard_ms + react_ms, abs=0.051)


@pytest.mark.parametrize("name", ["force", "silent", "still", "hangs"])
@pytest.mark.parametrize("baud", [row[0] for row in rows()])
def test_the_motor_brakes_within_it(baud, name, tmp_path):
    (row,) = (dict(zip(("period", "line", "force", "silent", "still", "hangs"), one[1:], strict=True))
              for one in rows() if one[0] == baud)  # fmt: skip
    setting = FAULTS.Setting(baud, period_s=1e-3 * row["period"])
    with rig("local", tmp_path, setting) as made:
        guard, world, places = made.guard, made.world, []
        guard.arm(setting.limits)
        period_ns = round(1e6 * row["period"])
        guard.advance(world.clock() + period_ns)
        sequence = guard.beat(Beat(1, world.clock())).force_sequence
        move = Beat(2, world.clock(), "approach", CommandKind.MOVE_TO, position_m=-0.5e-3, speed_m_s=SPEED_M_S,
                    force_sequence=sequence)  # fmt: skip
        assert guard.beat(move).accepted
        # 4.5 mm at 10 mm/s: on the way for 0.45 s, and at its speed after the first.
        for number in range(3, 3 + round(0.15e9 / period_ns)):
            guard.advance(world.clock() + period_ns)
            assert guard.beat(Beat(number, world.clock())).moving
        begin_s = 1e-9 * world.clock()
        match name:
            case "force":
                world.sensed = FAULTS.sensed({"one sample above the ceiling": begin_s})
            case "still":
                world.sensed = FAULTS.sensed({"force stuck": begin_s})
            case "silent":
                world.force.faults.append(FAULTS.DatagramFault("dropped", start_s=begin_s))
        last_beat_ns = world.clock()
        while guard.state is GuardState.ARMED and 1e-9 * world.clock() < begin_s + 0.2:
            places.append((1e-9 * world.clock(), world.position_m))
            guard.advance(world.clock() + 1_000_000)
            if name != "hangs" and world.clock() - last_beat_ns >= period_ns:
                number, last_beat_ns = number + 1, world.clock()
                guard.beat(Beat(number, world.clock()))
        while 1e-9 * world.clock() < begin_s + 0.25:
            places.append((1e-9 * world.clock(), world.position_m))
            guard.advance(world.clock() + 1_000_000)
        expected = {"force": Trigger.FORCE_CEILING, "silent": Trigger.FORCE_OLD, "still": Trigger.FORCE_STUCK,
                    "hangs": Trigger.BEAT_OLD}  # fmt: skip
        assert guard.trigger is expected[name]
        react, allowed_s = reaction(options(baud)), 1e-3 * row[name]
        # No host is late here. What is left after the command was given is line and lag.
        command = retreat_command(options(baud)).split(b"M")[0]
        sent_s = next(passed.t_s for passed in world.devices.log_of("motor")
                      if passed.sender == "host" and passed.t_s >= begin_s and passed.piece in command)  # fmt: skip
        assert sent_s - begin_s <= allowed_s - react.time_s + react.force_age_s
        # It braked when it was farthest in, after v/acc of braking and a look each millisecond.
        braked_s = max(places, key=lambda place: place[1])[0] - SPEED_M_S / FAULTS.STATED["acceleration_m_s2"] - 1e-3
        assert braked_s - begin_s <= allowed_s - react.scheduling_s

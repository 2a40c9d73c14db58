"""One axis by small steps: halted by the force, let back, and refused what is not known to be safe."""

import click
import numpy as np
import pytest

from tactbench.core.errors import LinkUnplugged
from tactbench.core.spec.rig_file import ForceEntry
from tactbench.devices.cli.jog import move_by_steps
from tactbench.devices.emulation.virtual_time import split_faults
from tactbench.plugin import load_object, load_registry
from tactbench.plugin.devices import DriverSettings, EmulatedDevice, EmulatedDevices, EmulatorSettings
from tests.conftest import ROOT, Verbs

ENTRY = ForceEntry(device="net-ft", link="emulated", zero_s=0.1)
CEILING_N, SKIN_M, N_M = 0.5, -2.5e-3, 2e3
MOTOR = {
    "baud": 115200, "increment_m": 1e-6, "speed_unit_m_s": 1e-4, "lower_m": -4e-3, "upper_m": 4e-3, "home_m": -3e-3,
    "speed_m_s": 5e-3, "acceleration_m_s2": 1.0, "corridor_m": 4e-6,
}  # fmt: skip


def steps(monkeypatch, *answers, faults=()):
    """Type answers; return what was asked and said, the largest force on the skin [N], and the motor at the end."""
    registry, heard, emulators = load_registry(), [], []
    pressed = [0.0]

    def senses(t_s):
        pressed.append(N_M * max(0.0, emulators[0].position_m - SKIN_M))
        return {"fz": pressed[-1]}

    given = iter(answers)

    def ask(text, **_):
        heard.append(text)
        devices.advance(devices.clock() + 100_000_000)  # somebody thinks
        return next(given)

    monkeypatch.setattr(click, "prompt", ask)
    monkeypatch.setattr("tactbench.devices.cli.jog.remark", heard.append)
    motor, box = registry.devices["faulhaber"], registry.devices["net-ft"]
    emulators.append(load_object(motor.emulator)(EmulatorSettings(senses, np.random.default_rng(1), MOTOR)))
    emulators.append(
        load_object(box.emulator)(EmulatorSettings(senses, np.random.default_rng(1), box.emulated_options))
    )
    of_link, _ = split_faults(faults)
    devices = EmulatedDevices({"motor": EmulatedDevice("bytes", emulators[0]),
                               "force": EmulatedDevice("datagram", emulators[1], of_link)})  # fmt: skip
    with (
        load_object(motor.driver)(DriverSettings(devices.opener("motor"), options=MOTOR, clock=devices.clock)) as axis,
        load_object(box.driver)(
            DriverSettings(devices.opener("force"), options=box.emulated_options, clock=devices.clock)
        ) as force,
    ):
        move_by_steps("motor", axis, force, ENTRY, CEILING_N)
    return heard, max(pressed), emulators[0]


def test_steps_go_where_they_are_typed_and_the_force_is_shown(monkeypatch):
    heard, largest_n, motor = steps(monkeypatch, "yes", "+", "-0.05", "")
    assert motor.position_m == pytest.approx(-2.95e-3, abs=1e-5)  # two corridors of the drive
    assert largest_n == 0.0
    assert "-2.90" in heard[2]


def test_it_halts_at_the_ceiling_and_goes_back(monkeypatch):
    heard, largest_n, motor = steps(monkeypatch, "yes", "1", "+", "-0.6", "")
    said = [text for text in heard if "ceiling" in text and ("was halted" in text or "no further" in text)]
    assert len(said) >= 2  # of the step, and of the next one
    # 1 mm/s for a look, the force's age and the drive's latency: some 20 ms, of 2 N/mm.
    assert CEILING_N < largest_n < CEILING_N + N_M * 1e-3 * 0.05
    assert motor.position_m < SKIN_M


@pytest.mark.parametrize("answers", [("no",), ("",), ("yes", "2", "nan", "far", "")])
def test_what_is_not_confirmed_too_long_or_no_number_moves_nothing(monkeypatch, answers):
    _, _, motor = steps(monkeypatch, *answers)
    assert motor.position_m == pytest.approx(-3e-3, abs=1e-9)


def test_an_axis_does_not_move_on_without_a_force(monkeypatch):
    with pytest.raises(LinkUnplugged):
        steps(monkeypatch, "yes", *["+"] * 20, faults=("unplug:start_s=3",))


def test_the_verb_opens_an_emulated_axis_of_a_rig_file(tmp_path, monkeypatch):
    answers, example = iter(["yes", "+", ""]), str(ROOT / "examples" / "rigs" / "emulated.yaml")
    monkeypatch.setattr(click, "prompt", lambda text, **_: next(answers))
    doctor = Verbs(tmp_path, here=True)
    doctor("doctor", "--rig-file", example, "--jog", "motor")
    assert list(answers) == []
    doctor("doctor", "--rig-file", example, "--jog", "joint-9", code=2)

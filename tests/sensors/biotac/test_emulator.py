"""The emulated BioTac on its bytes: golden vectors BT-4, the pause, every fault."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.plugin import UsageError
from tactbench.sensors.biotac import SPEC
from tactbench.sensors.biotac.codec import INDEX, decoded, sampling_command
from tactbench.sensors.biotac.emulator import REST, BioTacFault, Emulator

COUNTS = {**REST, "E1": 1739.0, "PAC": 2021.0, "PDC": 2000.0, "TDC": 1500.0}
WORD_S = 2 * 8 / 4.4e6
READ_S = WORD_S + 50e-6


def exchange(sensor, command, n=2, at_s=0.0, pause_s=50e-6):
    sensor.exchange(1, command, at_s)
    return sensor.exchange(1, bytes(n), at_s + WORD_S + pause_s)


@pytest.mark.parametrize(
    ("command", "answer"),
    [("A200", "6D58"), ("8000", "7F29"), ("8301", "7C80"), ("8600", "5DE0"), ("2000", "A55F"), ("8100", "A545"),
     ("C800", "A558"), ("0100", "A53F")],
    ids=lambda text: f"BT-4-{text}",
)  # fmt: skip
def test_exchanges(command, answer):
    assert exchange(Emulator(lambda t_s: COUNTS), bytes.fromhex(command)) == bytes.fromhex(answer)


@pytest.mark.parametrize("resend", ["2000", "5000"], ids=lambda text: f"BT-4-{text}")
def test_a_resend_repeats_the_last_word(resend):
    sensor = Emulator(lambda t_s: COUNTS)
    assert exchange(sensor, bytes.fromhex("8600")) == bytes.fromhex("5DE0")
    for n in range(1, 3):
        assert exchange(sensor, bytes.fromhex(resend), at_s=n * 1e-3, pause_s=0.0) == bytes.fromhex("5DE0")


def test_bt_4_too_short_a_pause():
    sensor = Emulator(lambda t_s: COUNTS)
    assert exchange(sensor, b"\xa2\x00", pause_s=49.9e-6) == b"\xa5\x2d"
    assert exchange(sensor, b"\xa2\x00", at_s=1.0) == b"\x6d\x58"
    # Reading on without a pause, within one period of the select, is as early.
    assert sensor.exchange(1, b"\xa2\x00\x00\x00", 2.0) == b"\xff\xff\xa5\x2d"


def test_bt_4_an_sp_has_more_electrodes():
    assert exchange(Emulator(lambda t_s: {**COUNTS, "E20": 2048.0}), b"\xc8\x00") == b"\x80\x01"


@pytest.mark.parametrize(
    ("command", "name", "answer"),
    [
        ("6110", "flex version", "4244"),
        ("6113", "software version", "30323338"),
        ("6113", "software version", "30333031"),
        ("6115", "serial number", "42543250303232304231314530303034"),
        ("6161", "cpu speed", "3E80"),
        ("6170", "sampling frequency", "1130"),
    ],
)
def test_bt_4_properties(command, name, answer):
    golden = bytes.fromhex(answer)
    sensor = Emulator(properties={name: golden})
    assert exchange(sensor, bytes.fromhex(command), len(golden)) == golden
    # Byte by byte, as the maker's library reads texts, up to the first FF.
    sensor.exchange(1, bytes.fromhex(command), 1.0)
    one_by_one = b"".join(sensor.exchange(1, b"\x00", 1.0 + READ_S + n * 1e-5) for n in range(len(golden) + 1))
    assert one_by_one == golden + b"\xff"


@pytest.mark.parametrize(
    ("command", "pause_s", "answer"),
    [("6112", 50e-6, "A545"), ("6192", 50e-6, "A53F"), ("4013", 50e-6, "A552"), ("6113", 10e-6, "A52E")],
    ids=["even parity", "unknown property", "read-only", "too early"],
)
def test_property_commands_that_are_refused(command, pause_s, answer):
    assert exchange(Emulator(), bytes.fromhex(command), pause_s=pause_s) == bytes.fromhex(answer)


@given(counts=st.floats(-1e4, 1e4), channel=st.sampled_from(SPEC.channels()))
def test_what_is_sensed_comes_back_to_the_converters_step_and_what_is_left_out_is_at_rest(counts, channel):
    command = sampling_command(INDEX[channel.name])
    assert decoded(exchange(Emulator(), command)).value == pytest.approx(channel.rest.value, abs=0.5)
    reply = decoded(exchange(Emulator(lambda t_s: {channel.name: counts}), command))
    assert reply.fault is None
    assert abs(reply.value - min(max(counts, 0.0), 4095.0)) <= 0.5


def test_a_stuck_channel_holds_what_it_read_and_lets_go():
    fault = BioTacFault("stuck-channel", start_s=1.0, end_s=5.0, channels=frozenset({"E1"}))
    sensor = Emulator(lambda t_s: dict.fromkeys(["E1", "E2"], 1000.0 + 100.0 * t_s), faults=[fault])
    e1, e2 = (
        [decoded(exchange(sensor, sampling_command(INDEX[name]), at_s=float(t))).value for t in range(7)]
        for name in ("E1", "E2")
    )
    assert (e1, e2) == ([1000, 1100, 1100, 1100, 1100, 1500, 1600], [1000, 1100, 1200, 1300, 1400, 1500, 1600])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("parity:channels=E5+E99", "E99"),
        ("error-reply:error=256", "256"),
    ],
)
def test_faults_that_are_none_are_refused(text, said):
    with pytest.raises(UsageError, match=said):
        BioTacFault.parse(text)

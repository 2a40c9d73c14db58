"""Golden vectors of the ASCII protocol, streams cut anywhere, and faults on the line."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.plugin import RigError
from tactbench.rigs.parallel_manipulator.motor.codec import (
    LONGEST_LINE,
    Command,
    CommandReader,
    FaulhaberOptions,
    Kind,
    Line,
    LineReader,
    encode,
)

# Commands as the drive reads them; all are answered OK.
ANSWERED_OK = {
    b"EN": Command("EN"), b"DI": Command("DI"), b"LA 1000": Command("LA", 1000), b"LA1000": Command("LA", 1000),
    b"M": Command("M"), b"V100": Command("V", 100), b"HO": Command("HO"), b"HO500": Command("HO", 500),
    b"SP50": Command("SP", 50), b"AC100": Command("AC", 100), b"DEC100": Command("DEC", 100),
    b"LL30000": Command("LL", 30000), b"LL-30000": Command("LL", -30000), b"APL1": Command("APL", 1),
    b"LPC800": Command("LPC", 800), b"LCC300": Command("LCC", 300),
}  # fmt: skip
# Commands, the drive's bytes, and the lines in them.
ANSWERED = [
    (b"POS", b"98956\r\n", [Line(Kind.VALUE, "98956")]),
    (b"pos", b"-1500\r\n", [Line(Kind.VALUE, "-1500")]),
    (b"M", b"OK\r\np\r\n", [Line(Kind.OK, "OK"), Line(Kind.NOTICE, "p")]),
    (b"M", b"p\r\nOK\r\n", [Line(Kind.NOTICE, "p"), Line(Kind.OK, "OK")]),
    (b"GRC", b"v\r\n120\r\n", [Line(Kind.NOTICE, "v"), Line(Kind.VALUE, "120")]),
    (b"GST", b"1001100\r\n", [Line(Kind.VALUE, "1001100")]),
    (b"XYZ", b"Unknown command\r\n", [Line(Kind.REFUSAL, "Unknown command")]),
    (b"LPC-5", b"Invalid parameter\r\n", [Line(Kind.REFUSAL, "Invalid parameter")]),
    (b"GOHOSEQ", b"Command not available\r\n", [Line(Kind.REFUSAL, "Command not available")]),
    (b"EN", b"Overtemperature - drive disabled\r\n", [Line(Kind.REFUSAL, "Overtemperature - drive disabled")]),
    (b"LA1000", b"", []),
]


@pytest.mark.parametrize("sent", ANSWERED_OK)
def test_commands_that_are_answered_ok(sent):
    command = ANSWERED_OK[sent]
    assert CommandReader().feed(sent + b"\r") == [command]
    assert encode(*command) == sent.replace(b" ", b"") + b"\r"


@pytest.mark.parametrize(("sent", "answer", "lines"), ANSWERED)
def test_answers(sent, answer, lines):
    (command,) = CommandReader().feed(sent + b"\r")
    assert encode(*command) == sent.upper() + b"\r"
    assert LineReader().feed(answer) == lines
    for line in lines:
        assert line.answers(command.name) == (line.kind is Kind.VALUE)


def test_lines_cut_anywhere_have_the_time_of_their_first_byte():
    reader = LineReader()
    pieces = [(b"O", 1), (b"K\r", 2), (b"\n", 3), (b"989", 4), (b"56\r\nv\r\n", 5)]
    assert [line for data, t_ns in pieces for line in reader.feed(data, t_ns)] == [
        Line(Kind.OK, "OK", 1), Line(Kind.VALUE, "98956", 4), Line(Kind.NOTICE, "v", 5),
    ]  # fmt: skip


@given(st.lists(st.binary(max_size=40), max_size=12))
@settings(max_examples=60)
def test_any_bytes_are_survived_and_the_next_line_is_read(pieces):
    reader, drive = LineReader(), CommandReader()
    for piece in pieces:
        reader.feed(piece)
        drive.feed(piece)
    # The line under way is spoilt by what came before; the one after it is not.
    assert reader.feed(b"\r\n98956\r\n")[-1] == Line(Kind.VALUE, "98956")
    assert drive.feed(b"\rLA1000\r")[-1] == Command("LA", 1000)


def test_a_line_without_end_is_given_up_in_bounded_memory():
    reader = LineReader()
    assert reader.feed(b"7" * 100_000) == []
    (line,) = reader.feed(b"\r\n")
    assert line.kind is Kind.GARBLED
    assert len(line.text) < 2 * LONGEST_LINE
    assert reader.feed(b"1\r\n") == [Line(Kind.VALUE, "1")]
    drive = CommandReader()
    assert drive.feed(b"L" * 100_000 + b"\r") == [Command("")]


def test_limits_are_rounded_down_and_never_to_nothing():
    options = FaulhaberOptions()
    assert [options.speed(v) for v in (0.05, 0.0519, -0.0519, 0.0)] == [50, 51, -51, 0]
    assert [options.current(i) for i in (0.8, 0.7999)] == [800, 799]
    assert options.acceleration(1.5) == 1500
    # What the drive's unit cannot express is refused, not made zero.
    for of, value in (
        (options.speed, 0.0004), (options.current, 13.0), (options.increments, math.nan), (options.increments, 1e9),
    ):  # fmt: skip
        with pytest.raises(RigError, match="drive"):
            of(value)
    assert FaulhaberOptions(speed_unit_m_s=1e-6).speed(0.0004) == 400

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
    Kind,
    Line,
    LineReader,
    encode,
)
from tactbench.rigs.parallel_manipulator.motor.profile import FaulhaberOptions

# FH-1: command, bytes, what the drive reads. All are answered OK.
ANSWERED_OK = [
    ("EN", "45 4E 0D", Command("EN")),
    ("DI", "44 49 0D", Command("DI")),
    ("LA 1000", "4C 41 20 31 30 30 30 0D", Command("LA", 1000)),
    ("LA1000", "4C 41 31 30 30 30 0D", Command("LA", 1000)),
    ("M", "4D 0D", Command("M")),
    ("LR-250", "4C 52 2D 32 35 30 0D", Command("LR", -250)),
    ("V100", "56 31 30 30 0D", Command("V", 100)),
    ("HO", "48 4F 0D", Command("HO")),
    ("HO500", "48 4F 35 30 30 0D", Command("HO", 500)),
    ("NP1000", "4E 50 31 30 30 30 0D", Command("NP", 1000)),
    ("NPOFF", "4E 50 4F 46 46 0D", Command("NPOFF")),
    ("SP50", "53 50 35 30 0D", Command("SP", 50)),
    ("AC100", "41 43 31 30 30 0D", Command("AC", 100)),
    ("DEC100", "44 45 43 31 30 30 0D", Command("DEC", 100)),
    ("LL30000", "4C 4C 33 30 30 30 30 0D", Command("LL", 30000)),
    ("LL-30000", "4C 4C 2D 33 30 30 30 30 0D", Command("LL", -30000)),
    ("APL1", "41 50 4C 31 0D", Command("APL", 1)),
    ("LPC800", "4C 50 43 38 30 30 0D", Command("LPC", 800)),
    ("LCC300", "4C 43 43 33 30 30 0D", Command("LCC", 300)),
]

OVERTEMPERATURE = "Overtemperature - drive disabled"
# FH-2: command, its bytes, the drive's bytes, the lines in them.
ANSWERED = [
    ("POS", "50 4F 53 0D", "39 38 39 35 36 0D 0A", [Line(Kind.VALUE, "98956")]),
    ("POS", "50 4F 53 0D", "2D 31 35 30 30 0D 0A", [Line(Kind.VALUE, "-1500")]),
    ("pos", "70 6F 73 0D", "39 38 39 35 36 0D 0A", [Line(Kind.VALUE, "98956")]),
    ("M", "4D 0D", "4F 4B 0D 0A 70 0D 0A", [Line(Kind.OK, "OK"), Line(Kind.NOTICE, "p")]),
    ("M", "4D 0D", "70 0D 0A 4F 4B 0D 0A", [Line(Kind.NOTICE, "p"), Line(Kind.OK, "OK")]),
    ("GRC", "47 52 43 0D", "31 32 30 0D 0A", [Line(Kind.VALUE, "120")]),
    ("GRC", "47 52 43 0D", "76 0D 0A 31 32 30 0D 0A", [Line(Kind.NOTICE, "v"), Line(Kind.VALUE, "120")]),
    ("TEM", "54 45 4D 0D", "33 32 0D 0A", [Line(Kind.VALUE, "32")]),
    ("OST", "4F 53 54 0D", "36 35 35 33 36 0D 0A", [Line(Kind.VALUE, "65536")]),
    ("OST", "4F 53 54 0D", "36 35 35 35 32 0D 0A", [Line(Kind.VALUE, "65552")]),
    ("OST", "4F 53 54 0D", "31 36 0D 0A", [Line(Kind.VALUE, "16")]),
    ("OST", "4F 53 54 0D", "36 35 37 39 32 0D 0A", [Line(Kind.VALUE, "65792")]),
    ("GST", "47 53 54 0D", "31 30 30 31 31 30 30 0D 0A", [Line(Kind.VALUE, "1001100")]),
    ("GFS", "47 46 53 0D", "30 31 30 30 0D 0A", [Line(Kind.VALUE, "0100")]),
    ("CST", "43 53 54 0D", "39 32 32 30 0D 0A", [Line(Kind.VALUE, "9220")]),
    (
        "XYZ",
        "58 59 5A 0D",
        "55 6E 6B 6E 6F 77 6E 20 63 6F 6D 6D 61 6E 64 0D 0A",
        [Line(Kind.REFUSAL, "Unknown command")],
    ),
    (
        "LPC-5",
        "4C 50 43 2D 35 0D",
        "49 6E 76 61 6C 69 64 20 70 61 72 61 6D 65 74 65 72 0D 0A",
        [Line(Kind.REFUSAL, "Invalid parameter")],
    ),
    (
        "GOHOSEQ",
        "47 4F 48 4F 53 45 51 0D",
        "43 6F 6D 6D 61 6E 64 20 6E 6F 74 20 61 76 61 69 6C 61 62 6C 65 0D 0A",
        [Line(Kind.REFUSAL, "Command not available")],
    ),
    (
        "EN",
        "45 4E 0D",
        "4F 76 65 72 74 65 6D 70 65 72 61 74 75 72 65 20 2D 20 64 72 69 76 65 20 64 69 73 61 62 6C 65 64 0D 0A",
        [Line(Kind.REFUSAL, OVERTEMPERATURE)],
    ),
    ("LA1000", "4C 41 31 30 30 30 0D", "", []),
    ("BAUD19200", "42 41 55 44 31 39 32 30 30 0D", "", []),
]


@pytest.mark.parametrize(
    ("text", "sent", "command"), ANSWERED_OK, ids=[f"FH-1.{i + 1}-{row[0]}" for i, row in enumerate(ANSWERED_OK)]
)
def test_commands_that_are_answered_ok(text, sent, command):
    assert CommandReader().feed(bytes.fromhex(sent)) == [command]
    assert encode(*command) == text.replace(" ", "").encode() + b"\r"


@pytest.mark.parametrize(
    ("text", "sent", "answer", "lines"), ANSWERED, ids=[f"FH-2.{i + 1}-{row[0]}" for i, row in enumerate(ANSWERED)]
)
def test_answers(text, sent, answer, lines):
    assert bytes.fromhex(sent) == text.encode() + b"\r"
    (command,) = CommandReader().feed(bytes.fromhex(sent))
    assert encode(*command) == text.upper().encode() + b"\r"
    assert LineReader().feed(bytes.fromhex(answer)) == lines
    for line in lines:
        assert line.answers(command.name) == (line.kind is not Kind.NOTICE)


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

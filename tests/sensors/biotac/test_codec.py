"""The BioTac's words: golden vectors BT-1, BT-2, BT-3, BT-5 and BT-6, worked out by hand from the public sources."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.sensors.biotac import SPEC
from tactbench.sensors.biotac.codec import (
    INDEX,
    PROPERTIES,
    STREAMING_INDEX,
    Fault,
    decoded,
    encoded,
    parity_holds,
    property_text,
    sampling_command,
    with_parity,
)
from tactbench.sensors.biotac.frames import DEFAULT_FRAME


def rows(table, width):
    words = table.split()
    return [tuple(words[n : n + width]) for n in range(0, len(words), width)]


BT1 = rows(
    """
    PAC 0 80 1   E5 21 AB 5   E15 31 BF 7   PDC 1 83 3   E6 22 AD 5   E16 32 C1 3
    TAC 2 85 3   E7 23 AE 5   E17 33 C2 3   TDC 3 86 3   E8 24 B0 3   E18 34 C4 3
    Hall 15 9E 5 E9 25 B3 5   E19 35 C7 5   E1 17 A2 3   E10 26 B5 5  E20 36 C8 3
    E2 18 A4 3   E11 27 B6 5  E21 37 CB 5   E3 19 A7 5   E12 28 B9 5  E22 38 CD 5
    E4 20 A8 3   E13 29 BA 5  E23 39 CE 5   E14 30 BC 5  E24 40 D0 3
    """,
    4,
)


@pytest.mark.parametrize(("name", "index", "byte", "ones"), BT1, ids=[f"BT-1-{row[0]}" for row in BT1])
def test_sampling_commands(name, index, byte, ones):
    assert sampling_command(INDEX[name]) == bytes([int(byte, 16), 0])
    assert (INDEX[name], int(byte, 16).bit_count()) == (int(index), int(ones))


def test_bt_1_the_streaming_of_protocol_1_1_is_never_switched_on():
    assert with_parity(0x40 | STREAMING_INDEX) == 0xA1
    for index in (STREAMING_INDEX, -1, 64):
        with pytest.raises(ValueError, match=str(index)):
            sampling_command(index)


BT2 = rows(
    """
    0 01 01  63 02 F8   512 20 01  1739 6D 58  3039 BC F8   1 01 08   64 04 01   645 29 29  2000 7C 80  3072 C1 01
    2 01 10  100 07 20  877 37 68  2021 7F 29  3106 C2 10   7 01 38   127 07 F8  1000 3E 40 2033 7F 89  3500 DA 61
    8 01 40  128 08 01  1023 3E F8 2047 7F F8  4000 FB 01   15 01 79  255 0E F8  1024 40 01 2048 80 01  4063 FD F8
    31 01 F8 256 10 01  1365 54 A8 2457 98 C8  4064 FE 01   32 02 01  500 1F A1  1500 5D E0 2730 AB 51  4094 FE F1
    33 02 08 511 1F F8  1638 67 31 3000 BA C1  4095 FE F8
    """,
    3,
)


@pytest.mark.parametrize(("value", "first", "second"), BT2, ids=[f"BT-2-{row[0]}" for row in BT2])
def test_data_replies(value, first, second):
    word = bytes.fromhex(first + second)
    assert encoded(int(value)) == word
    assert decoded(word) == (int(value), None)


BT3 = rows(
    """
    A545 - ERROR  A53F - ERROR  A52E - ERROR  A52D - ERROR  A558 - ERROR  A55F - ERROR  A552 - ERROR  A557 - ERROR
    0000 - NOT_CONNECTED  FFFF - NOT_CONNECTED  ED58 3787 PARITY  6D50 1738 PARITY  6D5A 1739 PARITY  6D5E 1739 RESERVED
    """,
    3,
)


@pytest.mark.parametrize(("word", "value", "fault"), BT3, ids=[f"BT-3-{row[0]}" for row in BT3])
def test_faulty_words_are_flagged(word, value, fault):
    assert decoded(bytes.fromhex(word)) == (None if value == "-" else int(value), Fault[fault])


def test_bt_5_default_frame():
    golden = bytes.fromhex(
        "A2 80 A4 80 A7 80 A8 80 AB 80 AD 80 AE 80 B0 80 B3 80 B5 80 B6 80 B9 80 BA 80 BC 80 BF 80 C1 80 C2 80 C4 80 "
        "C7 80 83 80 85 80 86 80"
    )
    assert bytes(sampling_command(INDEX[name])[0] for name in DEFAULT_FRAME) == golden


def numbers(table):
    return [tuple(map(float, row)) for row in rows(table, 2)]


def test_bt_6_conversions_by_the_spec_s_numbers():
    values = {name: SPEC.parameters[name].value for name in ("thermistor_p", "thermistor_q", "thermistor_b")}
    for count, kilohm in numbers("645 53.488 877 36.693 1739 13.548 3039 3.475 3106 3.184 4095 0"):
        # Printed with three decimals.
        ohm = (4095 / count - 1) * SPEC.parameters["reference_resistor"].to("ohm")
        assert ohm == pytest.approx(1e3 * kilohm, abs=0.5)
    for count, degc in numbers("500 13.982 1000 29.799 1500 40.317 2000 48.579 3000 61.839 4095 73.962"):
        x = count / 4095
        logarithm = math.log((values["thermistor_p"] - values["thermistor_q"] * x) / x)
        assert values["thermistor_b"] / logarithm - 273.15 == pytest.approx(degc, abs=5e-4)
    for kind, table in (("dc_pressure", "100 3650 4095 149467.5"), ("ac_pressure", "100 37 2048 757.76")):
        (channel,) = SPEC.channels(kind)
        for counts, pascal in numbers(table):
            assert channel.scale.to("Pa/count") * counts == pytest.approx(pascal, rel=1e-12)
    # The manual's formula for TAC lies outside its own range: it stays in counts.
    (tac,) = SPEC.channels("ac_temperature")
    assert tac.scale is tac.measures is None


@pytest.mark.parametrize(
    ("name", "raw", "shown"),
    [
        ("flex version", "42 44", "B.D"),
        ("software version", "30 32 33 38", "2.38"),
        ("software version", "30 33 30 31", "3.01"),
        ("serial number", "42 54 32 50 30 32 32 30 42 31 31 45 30 30 30 34", "BT-2P-02.2.0-B-11-E-0004"),
    ],
    ids=["BT-4-flex", "BT-4-238", "BT-4-301", "BT-4-serial"],
)
def test_properties_as_the_makers_tools_show_them(name, raw, shown):
    assert property_text(name, bytes.fromhex(raw)) == shown
    assert len(bytes.fromhex(raw)) == PROPERTIES[name][1]


@given(value=st.integers(0, 4095), bit=st.integers(0, 15))
def test_a_single_wrong_bit_never_passes_as_a_datum(value, bit):
    word = encoded(value)
    assert decoded(word) == (value, None)
    turned = (int.from_bytes(word, "big") ^ 1 << bit).to_bytes(2, "big")
    assert decoded(turned).fault in (Fault.PARITY, Fault.ERROR)


@given(word=st.binary(max_size=6))
def test_any_bytes_are_read_and_only_true_words_pass(word):
    reply = decoded(word)
    if reply.fault is None:
        assert encoded(reply.value) == word
    elif reply.fault is Fault.PARITY:
        assert not all(parity_holds(byte) for byte in word)

"""The iCub skin's frames against golden vectors, and a decoder that loses no more than was lost."""

from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tactbench.plugin import Quality, UsageError
from tactbench.plugin.devices import CanFrame
from tactbench.sensors.icub.codec import (
    BoardSetup,
    OldSetup,
    OldSetup2,
    SkinDecoder,
    Transmit,
    TriangleSetup,
    Version,
    VersionRequest,
    command_frame,
    read_command,
    read_version,
    skin_frames,
    version_frame,
)

GOOD, MISSING, SATURATED, SUSPECT = Quality.GOOD, Quality.MISSING, Quality.SATURATED, Quality.SUSPECT
PERIOD_S = 0.02
PERIOD_NS = 20_000_000
HEAD, TAIL = "40" + "F0" * 7, "C0" + "F0" * 5

COMMANDS = [
    ("t20E44D0128F0", BoardSetup(1, 40, 240)),
    ("t20E44D0028F0", BoardSetup(0, 40, 240)),
    ("t20E44D0732F5", BoardSetup(7, 50, 245)),
    ("t20144D0814F0", BoardSetup(8, 20, 240)),
    ("t20E750000F00010022", TriangleSetup(0, 15, 0, True, 0x2200)),
    ("t20E750000402010022", TriangleSetup(0, 4, 2, True, 0x2200)),
    ("t20E750050500000022", TriangleSetup(5, 5, 0, False, 0x2200)),
    ("t20E750080B02010020", TriangleSetup(8, 11, 2, True, 0x2000)),
    ("t20E20700", Transmit(True)),
    ("t20E20701", Transmit(False)),
    ("t20F20701", Transmit(False)),
    ("t20E84C01010100200000", OldSetup()),
    ("t20E84E0222F000FFFF0A", OldSetup2()),
]
"""Lawicel text, which is identifier, length and data, and the command."""

PAIRS = """
    4E3 40F0F0F0F0F0F0F0 C0F0F0F0F0F00000 GGGGGGGGGGGG
    4E0 40F5F5F5F5F5F5F5 C0F5F5F5F5F50000 GGGGGGGGGGGG
    4E4 400A0B0C0D0E0F10 C011121314150000 GGGGGGGGGGGG
    4E1 40F0F0F0F0F0B4F0 C0F0F0F0F0F00000 GGGGGGGGGGGG
    4E2 40F0F0F0F0F0F0F0 C064F0F0F0000000 GGGGGGGGGGGE
    4E2 40FFF0F0F0F0F0F0 C0F0F0F0F0F00010 RGGGGGGGGGGG
    4E2 40F0F0F0F0F0F0F0 C0F0F0F0F0008000 GGGGGGGGGGGR
    41F 40F0F0F0F0F0F0F0 C0F0F0F0F0F00001 SSSSSSSSSSSS
    4FF 4000000000000000 C00000000000FFF2 MMMMMMMMMMMM
    400 40FFFFFFFFFFFFFF C0FFFFFFFFFF0000 EEEEEEEEEEEE
    3E3 40F0F0F0F0F0F0F0 C0F0F0F0F0F00000 GGGGGGGGGGGG
"""
"""Identifier, head and tail; quality of each taxel: good, at its end, out of range, suspect, missing."""
MARKS = {"G": GOOD, "E": SATURATED, "R": SATURATED | SUSPECT, "S": SUSPECT, "M": MISSING}

WORDS = """
    0000: 0010:0 0020:1 0040:2 0080:3 0100:4 0200:5 0400:6 0800:7 1000:8 2000:9 4000:10 8000:11
    0001: 0002: 0003: 0004: 0008: 8010:0,11 0801:7 FFF0:0,1,2,3,4,5,6,7,8,9,10,11 FFF2:0,1,2,3,4,5,6,7,8,9,10,11
    0550:0,2,4,6 00F0:0,1,2,3 0F00:4,5,6,7 F000:8,9,10,11
"""
"""Bytes 6 and 7 of the tail, and taxels out of range; 1 is no acknowledgement, 2 not connected, 4 and 8 reserved."""


def frame(identifier, data):
    return CanFrame(identifier, bytes.fromhex(data))


def pair(t_ns=0, value=240, word=0):
    return skin_frames(14, 3, [value] * 12, word, t_ns=t_ns)


def fed(decoder, *frames):
    return [sample for one in frames for sample in decoder.feed(one)]


@pytest.mark.parametrize(("text", "command"), COMMANDS, ids=[f"IC-1.{n}" for n in range(1, len(COMMANDS) + 1)])
def test_commands(text, command):
    identifier = int(text[1:4], 16)
    wanted = frame(identifier, text[5:])
    assert command_frame(identifier & 0xF, command) == wanted
    assert read_command(wanted) == (identifier & 0xF, command)


@pytest.mark.parametrize("line", PAIRS.strip().splitlines(), ids=[f"IC-2.{n}" for n in range(1, 12)])
def test_pairs(line):
    number, head, tail, marks = line.split()
    identifier = int(number, 16)
    frames = frame(identifier, head), frame(identifier, tail)
    board, triangle, old = identifier >> 4 & 0xF, identifier & 0xF, identifier >> 8 == 3
    taxels, word = frames[0].data[1:] + frames[1].data[1:6], int(tail[-4:], 16)
    assert skin_frames(board, triangle, taxels, word, old=old) == frames
    decoder = SkinDecoder(PERIOD_S, old_ids=True)
    assert decoder.feed(frames[0]) == []
    (sample,) = decoder.feed(frames[1])
    assert (sample.board, sample.triangle, sample.taxels) == (board, triangle, taxels)
    assert sample.quality == tuple(MARKS[mark] for mark in marks)


@pytest.mark.parametrize("entry", WORDS.split(), ids=lambda entry: f"IC-3-{entry[:4]}")
def test_error_words(entry):
    data, _, numbers = entry.partition(":")
    word, taxels = int(data, 16), [int(number) for number in numbers.split(",") if number]
    decoder = SkinDecoder(PERIOD_S)
    (sample,) = fed(decoder, frame(0x4E3, HEAD), frame(0x4E3, TAIL + data))
    if word & 2:
        assert set(sample.quality) == {MISSING}
    else:
        assert [taxel for taxel, mark in enumerate(sample.quality) if mark & SATURATED] == taxels
        suspect = list(range(12)) if word & 0xD else taxels
        assert [taxel for taxel, mark in enumerate(sample.quality) if mark & SUSPECT] == suspect
    counts = decoder.counts[14, 3]
    wrong = {f"T{taxel + 1} out of range": 1 for taxel in taxels}
    wrong |= {"samples not acknowledged": 1} if word & 1 else {}
    assert counts == wrong | ({"samples not connected": 1} if word & 2 else {})


def test_version_as_the_firmware_lays_it_out():
    # Message_GET_VERSION: command, board type, version and build, protocol, whether it fits; to the one who asked.
    version = Version(11, (1, 2, 3), (2, 1), True)
    answer, request = frame(0x2E0, "1C 0B 01 02 03 02 01 01"), frame(0x20E, "1C 02 01")
    assert (version_frame(14, version), command_frame(14, VersionRequest(2, 1))) == (answer, request)
    assert (read_version(answer), read_command(answer)) == ((14, version), None)
    assert (read_version(request), read_command(request)) == (None, (14, VersionRequest(2, 1)))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: command_frame(14, BoardSetup(period_ms=256)),
        lambda: command_frame(14, TriangleSetup(first=5, last=4)),
        lambda: SkinDecoder(float("nan")),
    ],
)
def test_numbers_that_do_not_fit_are_refused(wrong):
    with pytest.raises(UsageError):
        wrong()


def test_halves_pair_in_their_order_on_the_bus():
    """A host that is late between two frames came to two samples of a half each."""
    head, tail = pair(0, 240)
    decoder = SkinDecoder(PERIOD_S)
    (late,) = fed(decoder, head, replace(tail, t_ns=round(0.8 * PERIOD_NS)))
    assert (late.taxels, set(late.quality)) == (bytes([240] * 12), {SUSPECT})
    assert decoder.counts[14, 3] == {"halves far apart": 1}


def test_equal_samples_in_a_burst_are_not_doubled():
    # A host that was late reads several equal samples at one time.
    decoder = SkinDecoder(PERIOD_S)
    samples = fed(decoder, *pair(), *pair(), *pair())
    assert len(samples) == 3
    assert decoder.counts[14, 3] == {}


def test_frames_of_wrong_length_and_kind_are_kept_out():
    decoder = SkinDecoder(PERIOD_S)
    head, tail = pair()
    wrong = (frame(0x4E3, "80" + HEAD[2:]), replace(head, extended=True), *(CanFrame(0x4E3, data) for data in (
        b"", head.data[:1], tail.data[:5])))  # fmt: skip
    assert fed(decoder, *wrong) == []
    assert (decoder.foreign, decoder.counts[14, 3]) == (3, {"frames of wrong length": 2})
    (sample,) = fed(decoder, head, tail)
    assert set(sample.quality) == {GOOD}


frames = st.builds(
    CanFrame,
    st.one_of(st.integers(-1, 0x1FFFFFFF), st.sampled_from([0x4E3, 0x3E3, 0x20E, 0x2E0])),
    st.one_of(
        st.binary(max_size=64),
        st.builds(
            lambda first, rest: bytes([first]) + rest,
            st.sampled_from([0x40, 0xC0, 0x4C, 0x4D, 0x50, 0x1C]),
            st.binary(max_size=8),
        ),
    ),
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
)


@given(st.lists(frames, max_size=30))
@settings(max_examples=100, deadline=None)
@example([CanFrame(0x4E3, bytes([0x40]) * 8, t_ns=-5)])
def test_any_frames_are_survived_and_the_next_sample_is_whole(given_frames):
    decoder = SkinDecoder(PERIOD_S, old_ids=True)
    for one in given_frames:
        decoder.feed(one)
        found = read_command(one)
        ascends = found is None or not isinstance(found[1], TriangleSetup) or found[1].first <= found[1].last < 16
        if found is not None and ascends:
            assert read_command(command_frame(*found)) == found
        read_version(one)
    # The latest time of all: what was pending is proven incomplete, what follows is whole.
    late = 2**63 + PERIOD_NS
    *_, sample = fed(decoder, *pair(late, 77))
    assert sample.taxels == bytes([77] * 12)
    assert MISSING not in sample.quality


@given(
    taxels=st.lists(st.integers(1, 255), min_size=12, max_size=12),
    word=st.integers(0, 0xFFFF),
    lost=st.sets(st.integers(0, 39)),
)
@settings(max_examples=100, deadline=None)
def test_every_frame_that_comes_is_in_a_sample_and_none_is_made_up(taxels, word, lost):
    sent = [half for k in range(20) for half in skin_frames(14, 3, taxels, word, t_ns=k * PERIOD_NS)]
    decoder = SkinDecoder(PERIOD_S)
    samples = fed(decoder, *(one for k, one in enumerate(sent) if k not in lost)) + decoder.flush()
    found = {sample.t_ns // PERIOD_NS: sample for sample in samples}
    assert len(found) == len(samples)
    came = {(k // 2, k % 2) for k in set(range(40)) - lost}
    assert found.keys() == {period for period, _ in came}
    for period, sample in found.items():
        head, tail = ((period, half) in came for half in (0, 1))
        assert sample.taxels == (bytes(taxels[:7]) if head else bytes(7)) + (bytes(taxels[7:]) if tail else bytes(5))
    if samples:
        counts = decoder.counts[14, 3]
        assert counts["heads missing"] == sum((period, 0) not in came for period in found)
        assert counts["tails missing"] == sum((period, 1) not in came for period in found)
        assert "frames doubled" not in counts

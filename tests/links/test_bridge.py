"""The SPI bridge: frames, the emulator byte by byte, and the link to it over a pseudo-terminal."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.links.bridge_emulator import BridgeEmulator
from tactbench.links.link import SerialLink
from tactbench.links.spi_link import HELLO, SETUP, Frame, FrameDecoder, Kind, encode_frame
from tactbench.plugin.devices import LinkError, LinkTimeout, SpiBridge, SpiStep
from tests.links.ends import loopback, pty, serving

ROOT = Path(__file__).resolve().parents[2]

FRAMES = st.builds(
    Frame,
    kind=st.integers(0, 255),
    number=st.integers(0, 65535),
    payload=st.binary(max_size=64)
    | st.integers(240, 520).map(lambda n: b"\x01" * n)
    | st.integers(240, 520).map(bytes),
    version=st.integers(0, 255),
)


def test_vectors_of_the_format():
    """A bus that answers each byte's complement; requests at 1 s, replies by 2 s."""
    text = (ROOT / "firmware" / "biotac_bridge" / "vectors.txt").read_text(encoding="utf-8")
    lines = [(line[0], bytes.fromhex(line[1:])) for line in text.splitlines()]
    assert [side for side, _ in lines] == list("><" * 3)
    emulator = BridgeEmulator(Complement())
    for (_, request), (_, reply) in zip(lines[::2], lines[1::2], strict=True):
        (frame,) = FrameDecoder().feed(request)
        assert encode_frame(frame) == request
        assert sent(emulator.feed(request, 1.0) + emulator.poll(2.0)) == reply


@settings(max_examples=60)
@given(st.binary(max_size=300), st.lists(FRAMES, min_size=1, max_size=5), st.integers(1, 40))
def test_after_any_bytes_frames_come_back_in_any_pieces(noise, frames, piece):
    """One zero byte ends the noise."""
    data = b"".join(map(encode_frame, frames))
    decoder = FrameDecoder()
    decoder.feed(noise + b"\0")
    found = [frame for place in range(0, len(data), piece) for frame in decoder.feed(data[place : place + piece])]
    assert found == frames


class Complement:
    """A device on the emulated bus that answers each byte's complement, and keeps its requests."""

    def __init__(self):
        self.received = []

    def __call__(self, select, data, now_s):
        self.received.append((select, data, now_s))
        return bytes(255 - byte for byte in data)


def sent(pieces):
    return b"".join(piece for _, piece in pieces)


def replies(pieces):
    return FrameDecoder().feed(sent(pieces))


def batch(*steps):
    parts = [bytes([s.select]) + s.pause_us.to_bytes(2, "little") + len(s.data).to_bytes(2, "little") for s in steps]
    return b"".join(head + step.data for head, step in zip(parts, steps, strict=True))


def transfer(link, data):
    link.send([SpiStep(data)])
    return link.receive(2.0).data[0]


def ready(**options):
    bus = Complement()
    emulator = BridgeEmulator(bus, **options)
    emulator.feed(encode_frame(Frame(Kind.SETUP, 0, SETUP.pack(1_000_000, 0))), 0.0)
    return emulator, bus


def test_a_batch_runs_by_the_bus_clock_and_its_pauses():
    """At 1 MHz two bytes take 16 us: the second transfer begins after 16 + 50 us, the reply is due after 92 us."""
    emulator, bus = ready()
    request = encode_frame(Frame(Kind.BATCH, 5, batch(SpiStep(b"\x81\x00", 3, 50), SpiStep(b"\0\0", 1, 10))))
    assert emulator.feed(request, 2.0) == []
    assert [(select, data) for select, data, _ in bus.received] == [(3, b"\x81\x00"), (1, b"\0\0")]
    assert [t_s for *_, t_s in bus.received] == pytest.approx([2.0, 2.000066], abs=1e-12)
    assert emulator.next_s() == pytest.approx(2.000092, abs=1e-12)
    assert emulator.poll(2.00009) == []
    ((over_s, data),) = emulator.poll(2.0001)
    assert over_s == pytest.approx(2.000092, abs=1e-12)
    assert emulator.next_s() == math.inf
    (reply,) = FrameDecoder().feed(data)
    assert reply == Frame(0x83, 5, (2_000_000).to_bytes(4, "little") + b"\x7e\xff\xff\xff")


@pytest.mark.parametrize(
    "frame",
    [
        Frame(Kind.HELLO, 9, version=2),
        Frame(0x55, 9),
        Frame(Kind.BATCH, 9, batch(SpiStep(b"abc"))[:-1]),
        Frame(Kind.BATCH, 9, batch(SpiStep(b"a", 0x80))),
    ],
)
def test_the_bridge_refuses_what_it_cannot_do(frame):
    emulator, _ = ready(largest_payload=100, select_lines=0x07)
    (reply,) = replies(emulator.feed(encode_frame(frame), 0.0))
    assert (reply.kind, reply.number) == (Kind.ERROR.reply, 9)


needs_pty = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are POSIX")


@pytest.fixture
def emulator():
    return BridgeEmulator(Complement(), fastest_hz=4_000_000, select_lines=0x07, largest_payload=1000, holds=3)


@pytest.fixture
def link(emulator):
    with serving(emulator) as far, SpiBridge(SerialLink(far.name), speed_hz=4_400_000) as link:
        yield link


@needs_pty
def test_a_batch_that_the_bridge_refuses_is_an_error_and_the_link_goes_on(link):
    with pytest.raises(LinkError, match="1000"):
        link.send([SpiStep(bytes(1000))])
    link.send([SpiStep(b"a", 8)])
    with pytest.raises(LinkError, match="malformed"):
        link.receive(2.0)
    assert transfer(link, b"\xff") == b"\x00"


@needs_pty
def test_replies_that_do_not_come_are_a_timeout_then_a_gap_and_abandoned_leave_room(link, emulator, monkeypatch):
    monkeypatch.setattr(emulator, "poll", lambda now_s: emulator._due.clear() or [])
    assert link.holds == 3
    numbers = [link.send([SpiStep(b"a")]) for _ in range(3)]
    with pytest.raises(LinkTimeout):
        link.receive(0.1)
    link.abandon()
    monkeypatch.undo()
    assert link.send([SpiStep(b"\x01")]) == numbers[-1] + 1
    reply = link.receive(2.0)
    assert (reply.number, reply.data) == (numbers[-1] + 1, (b"\xfe",))


@needs_pty
def test_what_is_no_bridge_is_said(tmp_path):
    with pty() as far, pytest.raises(LinkError, match=r"0\.05 s"):
        SpiBridge(SerialLink(far.name), speed_hz=1000, wake_s=0.05)


@needs_pty
def test_a_bridge_of_another_version_is_refused():
    class Newer(BridgeEmulator):
        def feed(self, data, now_s):
            about = HELLO.pack(2, 10, 1, 1)
            return [(now_s, encode_frame(Frame(Kind.HELLO.reply, 0, about, version=2)))] if data else []

    with serving(Newer(loopback)) as far, pytest.raises(LinkError, match="version 2"):
        SpiBridge(SerialLink(far.name), speed_hz=1000)

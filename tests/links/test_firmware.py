"""The firmware of the SPI bridge, compiled for this machine: it speaks as its specification says."""

from __future__ import annotations

import shutil
import subprocess
import time
from contextlib import contextmanager
from itertools import pairwise

import pytest

from tactbench.core.errors import LinkTimeout
from tactbench.links.link import ByteLink, Link, Received
from tactbench.links.spi_link import Frame, FrameDecoder, Kind, SpiBridge, SpiStep, encode_frame
from tests.conftest import ROOT

STUB = ROOT / "tests" / "links" / "arduino"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("the firmware is not tried: there is no g++ here")
    built = tmp_path_factory.mktemp("firmware") / "bridge"
    flags = ["-std=c++17", "-pthread", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined", f"-I{STUB}"]
    subprocess.run([compiler, *flags, "-o", built, STUB / "main.cpp"], check=True)
    return built


class Pipe(ByteLink):
    """The program's stdin and stdout as a byte stream."""

    def __init__(self, process):
        super().__init__("firmware")
        self._process = process

    def read(self, timeout_s, *, size=65536):
        import select

        self._usable(timeout_s)
        if not select.select([self._process.stdout], [], [], timeout_s)[0]:
            raise self._nothing_came(timeout_s)
        return Received(self._process.stdout.read1(size), self._clock())

    def write(self, data):
        self._process.stdin.write(data)
        self._process.stdin.flush()

    def _release(self):
        self._process.stdin.close()
        self._process.wait(10.0)
        self._process.stdout.close()


@contextmanager
def running(program):
    link = Pipe(subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE))
    with link:
        yield link
    assert link._process.returncode == 0


def replies(link: Link, count: int) -> list[Frame]:
    decoder, found = FrameDecoder(), []
    while len(found) < count:
        found += decoder.feed(link.read(5.0).data)
    return found


def test_the_link_reads_through_it(program):
    with running(program) as link:
        bridge = SpiBridge(link, speed_hz=20_000_000)
        assert (bridge.name, bridge.firmware, bridge.holds, bridge.select_lines) == ("biotac_bridge", 2, 8, 7)
        assert bridge.speed_hz == 10_000_000
        numbers = [
            bridge.send([SpiStep(bytes([n, 0]), 1, 50), SpiStep(b"", 0, 300), SpiStep(b"\0", 2)]) for n in range(4)
        ]
        found = [bridge.receive(5.0) for _ in numbers]
        assert [one.number for one in found] == numbers
        assert [one.data for one in found] == [(bytes([255 - n, 255]), b"", b"\x64") for n in range(4)]
        begun = [one.device_us for one in found]
        assert all((b - a) % 2**32 >= 350 for a, b in pairwise(begun))  # the pauses are waited for
        frame = [SpiStep(bytes([n % 256] * 2), 1, 20) for n in range(140)]  # zero bytes, stretches without one
        bridge.send(frame)
        assert bridge.receive(5.0).data == tuple(bytes([255 - n % 256] * 2) for n in range(140))


def test_it_refuses_what_it_cannot_do_and_is_in_step_again_after_noise(program):
    step = b"\x01\0\0\x01\0\xaa"
    asked = [
        (Frame(Kind.BATCH, 1, step), b"not set up"),
        (Frame(Kind.SETUP, 2, b"\0\0\0\0\0"), b"clock or mode is not possible"),
        (Frame(Kind.SETUP, 2, b"\x20\xa1\x07\0\0"), b"clock or mode is not possible"),  # 0.5 MHz: beyond its divider
        (Frame(Kind.SETUP, 3, b"\x01"), b"malformed payload"),
        (Frame(Kind.HELLO, 4, b"", 9), b"version is unknown"),
        (Frame(9, 5), b"kind is unknown"),
        (Frame(Kind.SETUP, 6, b"\x40\x42\x0f\0\0"), None),
        (Frame(Kind.BATCH, 7, step[:-1]), b"malformed payload"),
        (Frame(Kind.BATCH, 8, b"\x08" + step[1:]), b"malformed payload"),
        (Frame(Kind.BATCH, 9), b"malformed payload"),
    ]
    with running(program) as link:
        link.write(bytes(range(1, 256)) * 20 + b"\0" + b"\x05abc\0\0")  # longer than its memory, and a short one
        for frame, why in asked:
            link.write(encode_frame(frame))
            (reply,) = replies(link, 1)
            assert reply.number == frame.number
            assert (reply.kind, reply.payload) == (Kind.ERROR.reply, why) if why else reply.kind == Kind.SETUP.reply
        busy = b"\0\xff\xff\0\0"  # 65 ms
        for number in range(9):
            link.write(encode_frame(Frame(Kind.BATCH, number, busy)))
        assert replies(link, 1) == [Frame(Kind.ERROR.reply, 8, b"full")]
        with pytest.raises(LinkTimeout):
            link.read(0.0)
        link.write(encode_frame(Frame(Kind.HELLO, 77)))  # answered while a batch runs
        assert replies(link, 1)[0].number == 77


@pytest.mark.parametrize(("hz", "runs_hz"), [(4_400_000, 4_363_636), (10_000_000, 10_000_000), (934_000, 933_852)])
def test_the_clock_that_is_set_is_answered(program, hz, runs_hz):
    """240 MHz by a whole number."""
    with running(program) as link:
        assert SpiBridge(link, speed_hz=hz).speed_hz == pytest.approx(runs_hz, abs=1)


def test_a_setup_holds_from_the_next_batch_on(program):
    long, short = b"\0\x20\x4e\0\0" * 5, b"\x02\0\0\x01\0\0"  # 100 ms, then a byte on the second line
    with running(program) as link:
        link.write(encode_frame(Frame(Kind.SETUP, 1, (2_000_000).to_bytes(4, "little") + b"\0")))
        link.write(encode_frame(Frame(Kind.BATCH, 2, long + short)))
        link.write(encode_frame(Frame(Kind.SETUP, 3, (8_000_000).to_bytes(4, "little") + b"\0")))
        link.write(encode_frame(Frame(Kind.BATCH, 4, short)))
        found = {reply.number: reply.payload for reply in replies(link, 4)}
    assert (found[2][4:], found[4][4:]) == (bytes([20]), bytes([80]))


def test_batches_keep_their_time_while_nobody_reads_the_replies(program):
    """Replies that the port does not take wait in the batches, of which it holds eight; nothing else waits for them."""
    batch = b"".join(b"\x01\xf4\x01\x64\0" + bytes(100) for _ in range(9))  # nine times 100 bytes and 500 us
    with running(program) as link:
        SpiBridge(link, speed_hz=4_400_000)
        for number in range(400):  # their replies are six times a pipe
            link.write(encode_frame(Frame(Kind.BATCH, number, batch)))
        time.sleep(0.2)
        found, decoder = [], FrameDecoder()
        while not found or found[-1].number != 999:
            try:
                found += decoder.feed(link.read(0.1).data)
            except LinkTimeout:  # all is read: there is room again
                link.write(encode_frame(Frame(Kind.HELLO, 999)))
    done = [frame for frame in found if frame.kind == Kind.BATCH.reply]
    assert [frame.number for frame in done] == sorted(frame.number for frame in done)
    begun = [int.from_bytes(frame.payload[:4], "little") for frame in done]
    late = [later - earlier for earlier, later in pairwise(begun[:8])]
    assert all(us >= 4500 for us in late)

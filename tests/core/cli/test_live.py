"""What is shown of a recording while it is made, on real terminals."""

import io
import os
import re
import select
import time
from contextlib import contextmanager

import numpy as np
import pytest
from rich.console import Console

from tactbench.core.cli.live import LiveView, one_line
from tactbench.core.cli.live_frame import Frame
from tactbench.core.cli.stream_state import StreamState, Watched
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tests.core.cli.fed_view import PAD, SCALE, SCENE, Fed
from tests.core.cli.terminals import (
    FIRST_SCREEN,
    HIDE_CURSOR,
    HOME,
    PIPE,
    ROOT,
    SECOND_SCREEN,
    SHOW_CURSOR,
    on_terminal,
    plain,
)
from tests.links.ends import pty

TWO_AND_A_HALF = "force 2.50 N, wanted 1.11 N"
WIRED = ROOT / "tests" / "third_party" / "wired"
RECORD = ("-m", "tactbench", "record", "--sensor", "icub", "--indenter", "cap:radius=10", "--out", "press.h5", "--live")


@contextmanager
def fed(tmp_path, **options):
    """Start the view on a terminal; give the terminal and what sends it a command and waits until it is done."""
    fifo = tmp_path / "commands"
    os.mkfifo(fifo)
    with on_terminal([str(ROOT / "tests/core/cli/fed_view.py"), str(fifo)], stdout=PIPE, **options) as terminal:
        with fifo.open("w", buffering=1) as commands:
            assert terminal.process.stdout.readline() == b"begun\n"

            def tell(command, wait=True):
                commands.write(f"{command}\n")
                if wait:
                    assert terminal.process.stdout.readline() == f"{command.split()[0]}\n".encode()

            yield terminal, tell
        terminal.process.stdout.close()


def test_the_screen_has_force_taxels_rates_and_losses(tmp_path):
    with fed(tmp_path) as (terminal, tell):
        for _ in range(5):
            tell("force 0")
        tell("gap")
        for _ in range(24):
            tell("force 2.5")
        lines = terminal.read_screen_with(TWO_AND_A_HALF, "3.0 of 10.0 s")  # two seconds of a rise of 5 N in 9 s
        assert len(lines) == 24
        assert max(map(len, lines)) <= 80
        assert lines[0].startswith("pad on a test")
        text = "\n".join(lines)
        assert re.search(r"t2 +\+250 ━", text), "a channel that falls under load rises here"
        assert re.search(r"t3 +\+500 ━", text)
        assert "warmth 31.25 degC" in text
        (pad,) = [line.split() for line in lines if line.startswith("pad  ")]
        (scale,) = [line.split() for line in lines if line.startswith("scale")]
        assert pad == ["pad", "300", "100/100", "7", "1", "0", "0", "1"]
        assert scale[1:3] == ["3000", "1000/1000"]
        tell("end", wait=False)
        assert "wanted 1.11 N" in terminal.last_words()
        assert terminal.process.wait(30) == 0
    assert terminal.seen.index(SECOND_SCREEN) < terminal.seen.index(HOME) < terminal.seen.index(FIRST_SCREEN)
    assert terminal.seen.rindex(SHOW_CURSOR) > terminal.seen.rindex(HIDE_CURSOR)


def test_ten_pictures_a_second_at_most(tmp_path):
    with fed(tmp_path) as (terminal, tell):
        began_s = time.monotonic()
        tell("busy 1.5")
        tell("end", wait=False)
        terminal.last_words()
        lasted_s = time.monotonic() - began_s
    drawn = terminal.seen.count(HOME)
    assert 3 <= drawn <= 10 * lasted_s + 2, "the one that was due as it began, and the first home of the second screen"


def test_a_new_size_is_a_new_picture(tmp_path):
    with fed(tmp_path) as (terminal, tell):
        tell("force 2.5")
        assert len(terminal.read_screen_with("taxels")) == 24
        terminal.resize(60, 30)
        seen = len(terminal.screens())
        while len(terminal.screens()) < seen + 3:
            terminal.read_until(HOME, 5)
        lines = terminal.screens()[-1]
        assert len(lines) == 30
        assert max(map(len, lines)) <= 60
        tell("end", wait=False)
        terminal.last_words()


def test_a_terminal_that_takes_nothing_holds_nothing_back(tmp_path):
    # A picture of 300 x 100 fills a pseudo-terminal's buffer, so that the second waits until somebody reads.
    with fed(tmp_path, columns=300, lines=100) as (terminal, tell):
        tell("busy 0.5")
        began_s = time.monotonic()
        tell("burst 3000")
        assert time.monotonic() - began_s < 20, "6000 blocks while nobody reads the terminal"
        tell("end", wait=False)
        terminal.last_words()
        assert terminal.process.wait(30) == 0


def test_whoever_is_asked_has_the_terminal(tmp_path):
    with fed(tmp_path) as (terminal, tell):
        tell("force 0")
        terminal.read_screen_with("taxels")
        tell("ask", wait=False)
        asked = terminal.read_until("Ctrl-C to end.")
        assert asked.rindex(FIRST_SCREEN) < asked.rindex("Place the cap.")
        assert asked.rindex(SHOW_CURSOR) < asked.rindex("Place the cap.")
        os.write(terminal.ours, b"\n")
        assert terminal.process.stdout.readline() == b"ask\n"
        tell("force 2.5")
        terminal.read_until(SECOND_SCREEN)
        terminal.read_screen_with("force 2.50 N")
        tell("end", wait=False)
        terminal.last_words()


def test_a_terminal_without_a_cursor_gets_lines(tmp_path):
    with fed(tmp_path, TERM="dumb") as (terminal, tell):
        tell("force 2.5")
        tell("end", wait=False)
        terminal.read_until(None, 30)
    assert "\x1b" not in terminal.seen
    assert "pad on a test: 0.1 of 10.0 s; force 2.50 N, wanted 0.00 N; pad 100/100 Hz; scale" in terminal.seen


def test_a_recording_of_the_twin_leaves_its_last_state(tmp_path):
    with on_terminal(RECORD, cwd=tmp_path) as terminal:
        said = terminal.last_words()
        assert terminal.process.wait(60) == 0
    assert "icub on twin (SIM), cap R 10 mm" in said
    assert "60.0 of 60.0 s" in said
    assert "wanted 5.00 N" in said
    assert re.search(r"taxels +5000 +83.33/83.33 +0 +0 +0 +0 +0 *\n", said)
    assert (tmp_path / "press.h5").exists()


@contextmanager
def wired(tmp_path, seconds):
    """Record a pad on a line that the test speaks for; give the terminal and the far end of the line."""
    command = ["-m", "tactbench", "record", "--sensor", "wired-pad", "--rig", "wired-rig"]
    command += ["--profile", f"ramp:duration={seconds}"]
    with pty() as line:
        address = f"serial://{line.name}?baud=115200"
        options = {"cwd": tmp_path, "path": [WIRED], "WIRED_LINK": address}
        with on_terminal([*command, "--out", "press.h5", "--live"], **options) as terminal:
            assert select.select([line.master], [], [], 60)[0]
            assert line.read_until(b"go\n") == b"go\n"
            yield terminal, line


def test_a_device_on_a_line_is_seen_while_it_is_recorded_and_when_it_falls_silent(tmp_path):
    with wired(tmp_path, "5") as (terminal, line):
        line.write(b"1 100 100\n2 100 100\n")
        terminal.read_screen_with("t1", "taxels 2 ")
        line.write(b"9 100 2000\n")
        lines = terminal.read_screen_with("taxels 3 ")
        assert "wired-pad on wired-rig, flat" in lines[0]
        assert "no reference force" in lines[1]
        # The level is the first half second's, which the third row is in or not.
        assert re.search(r"t1 +\+0 .*t2 +\+(1267|1900) ", "".join(lines))
        (row,) = [line.split() for line in lines if line.startswith("taxels  ")]
        assert row[3] == "6", "rows 3 to 8 are lost"
        terminal.read_screen_with("taxels 3 silent 2 s 6")
        line.write(b"10 100 100\n")
        terminal.last_words()
        assert terminal.process.wait(60) == 0
    assert (tmp_path / "press.h5").exists()


def test_ctrl_c_leaves_the_terminal_as_it_was(tmp_path):
    with wired(tmp_path, "1000") as (terminal, line):
        line.write(b"1 100 100\n")
        terminal.read_screen_with("taxels 1 ")
        os.write(terminal.ours, b"\x03")
        said = terminal.last_words()
        assert terminal.process.wait(60) == 130
    assert "What was recorded until then is in press.h5" in said
    assert said.endswith("Interrupted.\n")
    assert "Traceback" not in terminal.seen
    assert terminal.seen.rindex(SHOW_CURSOR) > terminal.seen.rindex(HIDE_CURSOR)
    assert (tmp_path / "press.h5").exists()


def state_of(*blocks, rate_hz=100.0, channels=2):
    spec = StreamSpec(
        name="s", rate_hz=rate_hz, channels=tuple(ChannelSpec(name=f"c{n}", kind="taxel") for n in range(channels))
    )
    state = StreamState(spec)
    for block in blocks:
        state.take(block)
    return state


def test_a_rate_is_that_of_the_last_two_seconds():
    slow = [Block("s", np.arange(5) * 20_000_000 + n * 100_000_000, np.zeros((5, 2))) for n in range(50)]
    quick = [
        Block("s", 5_000_000_000 + np.arange(10) * 10_000_000 + n * 100_000_000, np.zeros((10, 2))) for n in range(30)
    ]
    assert state_of(*slow).rate_hz == pytest.approx(50)
    assert state_of(*slow, *quick).rate_hz == pytest.approx(100, rel=0.01), "the first of the two ends before"
    assert state_of(slow[0]).rate_hz == pytest.approx(50)
    bursts = [Block("s", np.full(10, n * 100_000_000), np.zeros((10, 2))) for n in range(30)]
    assert state_of(bursts[0]).rate_hz is None, "rows that come together do not count twice"
    assert state_of(*bursts[:2]).rate_hz == state_of(*bursts).rate_hz == pytest.approx(100)
    timeless = state_of(Block("s", None, np.ones((10, 2))), Block("s", None, np.zeros((10, 2))))
    assert (timeless.rows, timeless.rate_hz, timeless.last_ns) == (20, None, None)
    assert timeless.level.tolist() == [1, 1], "the first block's"


def test_the_level_is_the_mean_of_the_first_half_second_and_missing_samples_are_in_none():
    times = np.arange(200) * 10_000_000
    data = np.where(np.arange(200)[:, None] <= 50, 10.0, 99.0) * np.ones(2)
    data[:51:2] += 1
    quality = np.zeros((200, 2), np.uint8)
    data[20, 1], quality[20, 1] = 1e6, Quality.MISSING
    data[199, 0], quality[199, 0] = 1e6, Quality.MISSING
    cut = [slice(0, 7), slice(7, 51), slice(51, 199), slice(199, 200)]
    state = state_of(*[Block("s", times[at], data[at], quality[at]) for at in cut])
    assert state.level.tolist() == [10 + 26 / 51, 10 + 25 / 50]
    assert state.latest.tolist() == [99, 99], "the last sample that was there"
    assert state.counts[Quality.MISSING] == 2


def test_the_sent_arrays_may_be_used_again():
    data, times = np.ones((3, 2)), np.arange(3)
    state = state_of(Block("s", times, data, np.zeros((3, 2), np.uint8)))
    data[:] = 7
    assert state.latest.tolist() == state.level.tolist() == [1, 1]


def watched(sensor=(PAD,), reference=(SCALE,)):
    return Watched("title", SCENE, tuple(map(StreamState, sensor)), tuple(map(StreamState, reference)))


def drawn(view, width, height):
    console = Console(width=width, height=height, file=io.StringIO(), force_terminal=False)
    return ["".join(one.text for one in line).rstrip() for line in
            console.render_lines(Frame(view), console.options.update(height=height))]  # fmt: skip


@pytest.mark.parametrize("width", [20, 80, 200])
@pytest.mark.parametrize("height", [5, 24, 70])
@pytest.mark.parametrize("taxels", [0, 1, 64, 500])
def test_a_picture_fits_whatever_there_is(width, height, taxels):
    rng = np.random.default_rng(1)
    channels = [ChannelSpec(name=f"a-long-name{n}", kind="taxel") for n in range(taxels)]
    other = ChannelSpec(name="other", kind="joint", unit="rad")
    view = watched(sensor=[StreamSpec(name="s", channels=(*channels, other))])
    for state in view.streams:
        drawn(view, width, height)
        for last in range(1, 100, 10):
            state.take(Block("s", np.arange(last, last + 10), rng.normal(size=(10, len(state.spec.channels)))))
    lines = drawn(view, width, height)
    assert len(lines) <= height
    assert max(map(len, lines)) <= width


def test_nothing_from_a_stream_is_said_and_no_force_is_no_error():
    view = watched(reference=())
    text = "\n".join(drawn(view, 80, 24))
    assert "no reference force" in text
    assert "waiting for samples" in text
    assert one_line(view) == "title: no times yet; pad -/100 Hz"


def test_blocks_of_streams_that_nobody_announced_are_passed_over(capsys):
    with LiveView(SCENE, "t") as view:
        view.watch(Block("early", None, np.zeros((1, 1))))
        view.begin(Fed(view))
        view.watch(Block("other", None, np.zeros((1, 1))))
    assert plain(capsys.readouterr().err) == "t: no times yet; force not known; pad -/100 Hz; scale -/1000 Hz\n"

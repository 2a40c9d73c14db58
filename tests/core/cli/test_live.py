"""What is shown of a recording while it is made: from the state of its streams to the screen of a terminal."""

import io
import os
import time
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from tactbench.core.cli.live import LiveView, StreamState
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import sourced
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tests.core.cli.terminals import FIRST_SCREEN, HIDE_CURSOR, SECOND_SCREEN, SHOW_CURSOR, on_terminal, plain
from tests.core.cli.test_screens import SCREENS

TAXELS = tuple(ChannelSpec(name=f"t{n}", kind="taxel", lower=0, upper=4095, sign=-1) for n in range(1, 5))
PAD = StreamSpec(
    name="pad", rate_hz=100, channels=(*TAXELS, ChannelSpec(name="warmth", kind="dc_temperature", unit="degC"))
)
SCALE = StreamSpec(name="scale", rate_hz=1000, channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1),))
RAMP = ForceRamp(
    end=sourced(5, "N", "test"), duration=sourced(10, "s", "test"), hold=sourced(1, "s", "test"), samples=1000
)


def test_a_picture_has_force_taxels_rates_and_losses(monkeypatch):
    class Acquisition:
        streams, reference = (PAD,), (SCALE,)

    view, lost = LiveView(Scene(name="fed", profile=RAMP), "pad on a test"), 0
    view.begin(Acquisition)
    for tenth in range(30):  # the pad falls by 100 counts a newton, its third taxel twice as much
        began_ns, force_n = tenth * 100_000_000, 2.5 * (tenth > 5)
        data = np.full((10, 5), 3000.0 - 100 * force_n)
        data[:, 2] -= 100 * force_n
        data[:, 4] = 31.25
        quality = np.zeros((10, 5), np.uint8)
        if tenth == 5:
            lost, quality[0], quality[-1, 0] = 7, Quality.GAP, Quality.SATURATED
        if tenth == 29:
            data[-1, 1], quality[-1, 1] = 1e9, Quality.MISSING  # the value before it is shown
        numbers = np.arange(10) + 10 * tenth + lost
        view.watch(Block("pad", began_ns + np.arange(10) * 10_000_000, data, quality, sequence=numbers))
        view.watch(Block("scale", began_ns + np.arange(100) * 1_000_000, np.full((100, 1), force_n)))
        view.watch(Block("a stream that nobody announced", None, np.zeros((1, 1))))
    console = Console(width=80, file=io.StringIO())
    console.print(view.picture())
    later_s = time.monotonic() + 3
    monkeypatch.setattr("tactbench.core.cli.live.time", SimpleNamespace(monotonic=lambda: later_s))
    console.print(view.picture())
    # Wanted are 1.11 N, two seconds of a rise of 5 N in 9 s; a channel that falls under load rises here.
    shown = [line.rstrip() for line in console.file.getvalue().splitlines()]
    assert shown == (SCREENS / "live.txt").read_text().splitlines()


def test_a_recording_is_seen_while_it_is_made_and_its_last_state_stays(verbs, monkeypatch):
    for name, value in (("FORCE_COLOR", "1"), ("TERM", "xterm"), ("LINES", "24")):
        monkeypatch.setenv(name, value)
    seen = verbs("record", "--sensor", "ideal", "--profile", "ramp:duration=1", "--live", "--out", "press.h5").stderr
    assert seen.rindex(SHOW_CURSOR) > seen.rindex(HIDE_CURSOR)
    last = plain(seen.rpartition(FIRST_SCREEN)[2])
    assert all(word in last for word in ("(SIM)", "83 rows", "0 lost"))


ASKS = """
from tactbench.core.cli.live import LiveView
from tests.core.cli.test_live import PAD, RAMP, Scene
class Acquisition: streams, reference = (PAD,), ()
with LiveView(Scene(name="fed", profile=RAMP), "pad") as view:
    view.begin(Acquisition)
    input()
    with view.paused():
        print("Place the cap.")
        input()
"""


def test_a_prompt_has_the_terminal(tmp_path):
    with on_terminal(["-c", ASKS], cwd=tmp_path) as terminal:
        terminal.read_until("0 rows")
        os.write(terminal.ours, b"\n")
        asked = terminal.read_until("Place the cap.")
        assert FIRST_SCREEN in asked
        assert SHOW_CURSOR in asked
        os.write(terminal.ours, b"\n")
        terminal.read_until(SECOND_SCREEN)
        terminal.last_words()
        assert terminal.process.wait(30) == 0


def test_a_rate_counts_rows_that_come_together_once():
    for many, period_ns, expected in ((1, 10_000_000, 100), (30, 10_000_000, 100), (1, 0, None), (30, 0, 100)):
        state = StreamState(PAD)
        for began_ns in np.arange(many) * 100_000_000:
            state.take(Block("s", began_ns + np.arange(10) * period_ns, np.zeros((10, 5))))
        assert state.rate_hz == (expected and pytest.approx(expected))

"""What is shown of a recording while it is made: the line, and a prompt that has the terminal to itself."""

import os

import numpy as np

from tactbench.core.cli.record import LiveView
from tactbench.core.samples import Block
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import sourced
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tests.core.cli.terminals import HIDE_CURSOR, SHOW_CURSOR, on_terminal

PAD = StreamSpec(name="pad", rate_hz=100, channels=(ChannelSpec(name="t1", kind="taxel", lower=0, upper=4095),))
SCALE = StreamSpec(name="scale", rate_hz=1000, channels=(ChannelSpec(name="fz", kind="force", unit="mN", sign=1),))
RAMP = ForceRamp(
    end=sourced(5, "N", "test"), duration=sourced(10, "s", "test"), hold=sourced(1, "s", "test"), samples=1000
)


def test_the_line_has_force_beside_the_planned_force_and_mean_rates(capsys):
    class Acquisition:
        streams, reference = (PAD,), (SCALE,)

    with LiveView(Scene(name="fed", profile=RAMP), "pad on a test") as view:
        view.begin(Acquisition)
        lines, waiting = [], view.line
        for tenth in range(31):  # the pad is silent from the second on
            began_ns, force_mn = 1_000_000_000 + tenth * 100_000_000, 2500.0 * (tenth > 5)
            if tenth < 20:
                view.watch(Block("pad", began_ns + np.arange(10) * 10_000_000, np.full((10, 1), 7.0)))
            view.watch(Block("scale", began_ns + np.arange(100) * 1_000_000, np.full((100, 1), force_mn)))
            view.watch(Block("a stream that nobody announced", None, np.zeros((1, 1))))
            lines.append(view.line.partition(": ")[2])
    assert waiting == "pad on a test: waiting for samples"
    # Of a rise of 5 N in 9 s after a hold of 1 s, at 1.2 s: 0.11 N; 120 rows in 1.199 s.
    assert lines[11] == "1.2 of 10.0 s, force 2.50 N, planned 0.11 N; pad 100.1 Hz, scale 1001 Hz"
    assert "pad 64.5" in capsys.readouterr().err, "200 rows in 3.1 s"


ASKS = """
from tactbench.core.cli.record import LiveView
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
        assert HIDE_CURSOR in terminal.read_until("waiting")
        os.write(terminal.ours, b"\n")
        assert SHOW_CURSOR in terminal.read_until("Place the cap.")
        os.write(terminal.ours, b"\n")
        assert HIDE_CURSOR in terminal.read_until("waiting")
        terminal.read_until(None, 30)
        assert terminal.process.wait(30) == 0

"""What a person sees and types: a bar or a line, the table so far, prompts, one sentence on Ctrl-C; in a log, lines."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from tactbench.core.cli.record import LiveView
from tactbench.core.cli.run import remark_stopped
from tactbench.core.cli.shared import print_records
from tactbench.core.errors import RigError
from tactbench.core.samples import Block
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import sourced
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import ChannelSpec, StreamSpec
from tactbench.core.study.terminal import TerminalOperator, progress
from tests.conftest import Verbs
from tests.core.cli.terminals import HIDE_CURSOR, SHOW_CURSOR, on_terminal

RUN = ("-m", "tactbench", "run", "--sensor", "ideal")
CURVATURE = (*RUN, "--task", "curvature", "--estimator", "logistic", "--repeats", "1")
FORCE = (*RUN, "--task", "force", "--estimator", "ols", "--repeats", "2")


def test_ctrl_c_ends_it_with_one_sentence_and_the_next_run_continues(tmp_path):
    for attempt in range(3):  # Python drops an interrupt that comes while it is inside a destructor: rare
        folder = tmp_path / str(attempt)
        folder.mkdir()
        with on_terminal(CURVATURE, cwd=folder, columns=140, lines=40) as terminal:
            assert " 4/15" in terminal.read_until(" 4/15")
            os.write(terminal.ours, b"\x03")
            terminal.read_until(None)
            code, seen = terminal.process.wait(60), terminal.seen
        if code == 130 and "Traceback" not in seen:
            break
    assert (code, "Interrupted" in seen, "Traceback" in seen, "KeyboardInterrupt" in seen) == (130, True, False, False)
    finished = {path: path.read_bytes() for path in folder.rglob("*.h5")}
    assert finished
    # As a process leaves it that is killed between the last two steps of a recording.
    Path(f"{next(iter(finished))}.partial").touch()
    Verbs(folder, here=True)(*CURVATURE[2:])
    assert {path: path.read_bytes() for path in finished} == finished, "what was finished is reused, not made again"
    assert not [path for path in folder.rglob("*") if path.suffix in (".partial", ".completing")]


def test_bars_are_gone_at_the_end_and_the_table_is_left(tmp_path):
    with on_terminal(FORCE, cwd=tmp_path, columns=140, lines=40) as terminal:
        seen = terminal.read_until(None, 100)
        assert terminal.process.wait(60) == 0
    assert seen.index("evaluating") < seen.index("RMSE")
    assert "evaluating" not in seen[seen.index("2 campaigns") :]


def test_a_line_a_tenth_says_how_far_and_how_many_stopped(capsys):
    with progress() as display:
        display.begin("evaluating", 40)
        for number in range(40):
            display.advance(f"cell {number}", stopped=number in (1, 2))
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1 + 10
    assert "40/40" in said.err.splitlines()[-1]
    assert "(2 stopped)" in said.err.splitlines()[-1]


def test_the_end_names_every_stopped_cell_and_how_to_look_into_it(capsys, tmp_path):
    rows = [
        {"cell": "a/b/c", "status": "failed", "reason": "RuntimeError: two\nlines\x1b[2J"},
        {"cell": "a/b/d e", "status": "timeout", "reason": "x" * 1000},
    ]
    remark_stopped(rows, tmp_path)
    said = capsys.readouterr()
    assert said.out == ""
    assert "lines\\x1b[2J\n" in said.err, "a reason moves no cursor"
    assert f"a/b/c --out {tmp_path}" in said.err
    assert max(len(line) for line in said.err.splitlines() if "a/b/d e" in line) < 260


ASKS_TWICE = """
from tactbench.core.study.terminal import TerminalOperator
from tactbench.core.errors import RigError
operator = TerminalOperator()
operator.prompt("Place.")
try:
    operator.prompt("Press.")
except RigError as error:
    print(error)
"""


def test_enter_answers_and_one_typed_before_does_not():
    with on_terminal(["-c", ASKS_TWICE]) as terminal:
        os.write(terminal.ours, b"\n")
        assert "Place." in terminal.read_until("Ctrl-C")
        os.write(terminal.ours, b"\n")
        assert "Press." in terminal.read_until("Ctrl-C")
        os.write(terminal.ours, b"\x04")  # Ctrl-D; had the first Enter answered, the second would have answered this
        said = terminal.read_until(None)
        assert terminal.process.wait(30) == 0
    assert "confirmed" in said


def test_without_a_terminal_somebody_has_to_be_there(monkeypatch):
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(RigError, match=r"Place\..*--yes"):
            TerminalOperator().prompt("Place.")


def test_a_record_that_lacks_a_key_leaves_its_field_empty(capsys):
    """Of two answers only one may have no trivial answer beside it."""
    print_records([{"sensor": "a", "why": "bar"}, {"sensor": "b"}], "table", title="sensors")
    assert [line.split() for line in capsys.readouterr().out.splitlines()[-2:]] == [["a", "bar"], ["b"]]


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
from tests.core.cli.test_on_a_terminal import PAD, RAMP, Scene
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

"""What a person sees while a matrix runs, and at its end."""

import pytest

from tactbench.core.cli.progress import Lines, duration
from tactbench.core.cli.run import one_line, tell_stopped


class Clock:
    """Six seconds later each time it is asked."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 6.0
        return self.now


def test_a_line_a_tenth_says_how_far_how_many_stopped_and_how_long_still(capsys):
    lines = Lines(Clock())
    lines.begin("evaluating", 40)
    for number in range(40):
        lines.advance(f"cell {number}", stopped=number in (1, 2))
    said = capsys.readouterr()
    assert said.out == ""
    shown = said.err.splitlines()
    assert len(shown) == 1 + 10
    assert shown[0] == "evaluating: 40 to do"
    assert shown[1] == "evaluating: 4/40 cell 3 (2 stopped, about 54 s to go)"
    assert shown[-1] == "evaluating: 40/40 cell 39 (2 stopped)"


@pytest.mark.parametrize(
    ("seconds", "shown"), [(0.2, "1 s"), (40, "40 s"), (120, "2 min"), (5400, "1 h 30 min"), (90_000, "25 h 0 min")]
)
def test_durations_are_rough(seconds, shown):
    assert duration(seconds) == shown


def test_the_end_names_every_stopped_cell_and_how_to_look_into_it(capsys, tmp_path):
    rows = [
        {"cell": "a/b/c", "status": "failed", "reason": "RuntimeError: two\nlines"},
        {"cell": "a/b/d e", "status": "timeout", "reason": "x" * 1000},
    ]
    tell_stopped(rows, tmp_path)
    said = capsys.readouterr()
    assert said.out == ""
    assert "Stopped: 1 failed, 1 timeout." in said.err
    assert "a/b/c: RuntimeError: two lines\n" in said.err
    assert f"tactbench why a/b/c --out {tmp_path}" in said.err
    assert f"tactbench why a/b/c --out {tmp_path} --again" in said.err
    assert max(len(line) for line in said.err.splitlines() if "a/b/d e" in line) < 260


def test_a_reason_moves_no_cursor():
    assert one_line("a\x1b[2Jb\r\nc") == "a\\x1b[2Jb c"

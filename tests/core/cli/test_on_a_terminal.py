"""A real terminal: the bar moves, Ctrl-C reaches every process at once, and nobody prints where it was."""

import fcntl
import os
import pty
import select
import sys
import termios
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.core.pool.patience import ending

ROOT = Path(__file__).parents[3]

COMMAND = [
    *(sys.executable, "-m", "tactbench", "run", "--repeats", "1", "--sensor", "ideal", "--task", "curvature"),
    *("--estimator", "logistic"),
]
FORCE = [
    *(sys.executable, "-m", "tactbench", "run", "--repeats", "1", "--sensor", "ideal", "--task", "force"),
    *("--estimator", "ols"),
]


@contextmanager
def started(folder, command):
    """Start a command as the foreground job of a new terminal; give the process and our end of the terminal."""
    ours, theirs = pty.openpty()

    def own_terminal():
        os.setsid()
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    env = {**os.environ, "COLUMNS": "140", "LINES": "40", "TERM": "xterm-256color", "PYTHONPATH": str(ROOT)}
    try:
        with ending(command, cwd=folder, env=env, stdin=theirs, stdout=theirs, stderr=theirs,
                    preexec_fn=own_terminal) as process:  # fmt: skip
            os.close(theirs)
            yield process, ours
    finally:
        os.close(ours)


def read_until(ours, text, seconds):
    """Return what came up to `text`, or all if it does not come in time."""
    seen, until = "", time.monotonic() + seconds
    while text not in seen and time.monotonic() < until:
        if not select.select([ours], [], [], 0.5)[0]:
            continue
        try:
            piece = os.read(ours, 65536)
        except OSError:  # the other side has closed
            break
        if not piece:
            break
        seen += piece.decode(errors="replace")
    return seen


def interrupted(folder, command, at):
    """Press Ctrl-C once `at` is on the screen; return the exit code, the screen and the files that were left aside."""
    folder.mkdir()
    with started(folder, command) as (process, ours):
        seen = read_until(ours, at, 60)
        assert at in seen
        os.write(ours, b"\x03")
        seen += read_until(ours, "goes on from there", 60)
        code = process.wait(60)
        seen += read_until(ours, "\0", 1)
    return code, seen, [path for path in folder.rglob("*") if path.suffix in (".partial", ".completing")]


@pytest.mark.parametrize(
    ("command", "at"),
    [(COMMAND, " 0/18"), (COMMAND, " 4/18"), ([*FORCE, "--estimator", "forest"], "/1")],
    ids=["the first recording", "a later one", "evaluating"],
)
def test_ctrl_c_ends_it_with_one_sentence(tmp_path, command, at):
    # Python prints and drops an interrupt that comes while it is inside a destructor. That is rare and nobody's to mend
    # here; what this test is for, processes that say where they were, happens every time.
    for attempt in range(3):
        code, seen, left = interrupted(tmp_path / str(attempt), command, at)
        if code == 130 and "Traceback" not in seen:
            break
    assert code == 130
    assert "goes on from there" in seen
    assert "Traceback" not in seen
    assert "KeyboardInterrupt" not in seen
    assert left == []


def test_the_table_so_far_comes_with_each_replicate_and_stays_off_the_end(tmp_path):
    command = [*FORCE]
    command[command.index("--repeats") + 1] = "2"
    with started(tmp_path, command) as (process, ours):
        seen = read_until(ours, "Files:", 100)
        assert process.wait(60) == 0
    assert seen.index("recording and evaluating") < seen.index("RMSE")
    assert seen.index("1 campaign") < seen.index("2 campaigns"), "the table is shown once a replicate is complete"
    assert "recording and evaluating" not in seen[seen.rindex("2 campaigns") :], "the last table alone is left"

"""kill -9 or Ctrl-C at random moments of a run: nothing is corrupt, nothing finished is lost, scores stay the same.

A small matrix is run once undisturbed. Then it is run in other folders and killed at moments drawn evenly from its
duration, the whole process group or the parent alone in turn, and started again at once, until it ends; the next folder
follows, until there were as many kills as asked for. After every kill: each cell file and each recording opens and
holds what its digest says, and every cell that was finished before is still finished, with the same row. At the end of
every folder: what a seed decides, and the table without times, are those of the undisturbed run, and no half-written
file is left. After Ctrl-C (`--interrupt`: SIGINT to the parent) no process of the run is left either.

Usage: python benchmarks/kill_nine.py [--interrupt] [--kills 100] [--matrix twin|trivial] [--repeats 100] [--jobs 2]
       [--seed 1]
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import psutil
import trivial

from tactbench.core.matrix.merge import SEED_DECIDES
from tactbench.core.matrix.store import Row, Store
from tactbench.core.recording.reader import open_recording

TWIN = (
    "--sensor", "icub", "--task", "curvature", "--repeats", "2", "--estimator", "lda", "--estimator", "logistic",
    "--estimator", "knn",
)  # fmt: skip
TRIVIAL = ("--task", "nothing-asked", "--estimator", "nothing")


def started(arguments: list[str], folder: Path) -> subprocess.Popen[bytes]:
    """Start the command line in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "tactbench", *arguments], cwd=folder, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip


def table(folder: Path, name: str) -> bytes:
    """Return the table of what a seed decides."""
    words = ["leaderboard", name, "--columns", "place,score,interval,cell", "--format", "latex"]
    done = subprocess.run([sys.executable, "-m", "tactbench", *words], cwd=folder, capture_output=True, check=True)
    return done.stdout


def checked(folder: Path, before: dict[str, Row]) -> dict[str, Row]:
    """Return the finished cells of a folder; AssertionError if anything is corrupt or lost."""
    store = Store(folder)
    finished = {row["cell"]: row for row in store.rows() if row["status"] == "done"}
    assert not store.troubles, store.troubles
    for row in finished.values():
        assert store.cell(row).answers, row["cell"]
    for path in (folder / "recordings").rglob("*.h5"):
        with open_recording(path) as recording:
            recording.verify()
    for name, row in before.items():
        assert finished.get(name) == row, f"the finished cell {name} was lost or changed"
    return finished


def scores(folder: Path) -> dict[str, Row]:
    """Return what a seed decides of each cell."""
    return {row["cell"]: {name: row[name] for name in SEED_DECIDES} for row in Store(folder).rows()}


def main() -> None:
    """Kill, check, and print what was seen; exit code 1 at the first promise that is not kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interrupt", action="store_true", help="Ctrl-C in place of kill -9.")
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--matrix", choices=("twin", "trivial"), default="twin")
    parser.add_argument("--repeats", type=int, default=100, help="Of the trivial matrix.")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng = random.Random(asked.seed)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        arguments = ["run", *TWIN]
        if asked.matrix == "trivial":
            shelf = trivial.install(folder / "plugin")
            trivial.use(folder / "plugin")
            arguments = ["run", *TRIVIAL, "--repeats", str(asked.repeats), "--recordings", str(shelf)]
        arguments += ["--jobs", str(asked.jobs)]
        began = time.monotonic()
        whole = started([*arguments, "--out", "whole"], folder)
        _, said = whole.communicate()
        assert whole.returncode == 0, said.decode()
        lasts = time.monotonic() - began
        cells = len(checked(folder / "whole", {}))
        wanted, shown = scores(folder / "whole"), table(folder, "whole")
        kills = {"group": 0, "parent": 0}
        folders, kept = 0, 0
        killed: list[subprocess.Popen[bytes]] = []
        while sum(kills.values()) < asked.kills:
            folders += 1
            name = f"out{folders}"
            finished: dict[str, Row] = {}
            while True:
                process = started([*arguments, "--out", name], folder)
                moment = rng.uniform(0, lasts)
                if sum(kills.values()) >= asked.kills:
                    moment = 1000 * lasts
                try:
                    _, said = process.communicate(timeout=moment)
                except subprocess.TimeoutExpired:
                    how = "group" if sum(kills.values()) % 2 == 0 and not asked.interrupt else "parent"
                    kill, which = (os.killpg, process.pid) if how == "group" else (os.kill, process.pid)
                    kill(which, signal.SIGINT if asked.interrupt else signal.SIGKILL)
                    # Not reaped yet: while a killed parent is a zombie, its number names its group and no stranger's.
                    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
                    kills[how] += 1
                    if asked.interrupt:
                        process.wait()
                        # Python that is starting ends by the signal itself.
                        assert process.returncode in (130, -signal.SIGINT), process.returncode
                        deadline = time.monotonic() + 5.0  # the fork server ends by itself when its owner has
                        while (left := _left(process.pid, folder)) and time.monotonic() < deadline:
                            time.sleep(0.05)
                        assert not left, f"processes are left: {[one.cmdline() for one in left]}"
                    finished = checked(folder / name, finished)
                    kept += bool(finished)
                    killed.append(process)
                    continue
                finally:
                    if process.stderr is not None:
                        process.stderr.close()
                assert process.returncode == 0, said.decode()
                break
            checked(folder / name, finished)
            assert scores(folder / name) == wanted, "scores differ"
            assert table(folder, name) == shown, "the table without times differs"
            left = [path for path in (folder / name / "cells").iterdir() if path.suffix != ".h5"]
            assert not left, f"left behind: {left}"
        for process in killed:
            _end(process.pid)
            process.wait()
    print(f"{sum(kills.values())} kills ({kills['group']} of the group, {kills['parent']} of the parent) of a run of "
          f"{cells} cells and {lasts:.1f} s in {folders} folders; {kept} left finished cells, all of which were kept; "
          "no corrupt file")  # fmt: skip
    print("scores, and the table without times, equal to the undisturbed run's in every folder")


def _left(parent: int, folder: Path) -> list[psutil.Process]:
    """Return the processes at work in `folder`, other than `parent`."""
    found = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.pid != parent and Path(process.cwd()).is_relative_to(folder):
                found.append(process)
    return found


def _end(group: int) -> None:
    """End what a killed parent has left of its group; nothing, where workers end with it."""
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        return


if __name__ == "__main__":
    main()

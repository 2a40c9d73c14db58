"""The same 20 small forest cells as a plain scikit-learn script, by tactbench cold and cached, and by benchopt.

Five made-up sets of 300 rows by 20 features, two thirds to train on, and forests of 5, 10, 20 and 40 trees: each way
fits the same 20 forests and prints accuracies. Whole processes, one thread, turn and turn about; before every cold run
results are removed. tactbench also makes an interval from 2,000 resamples for every cell; what else it measures by
default, the latency of single rows, is left out (``latency: false``) where it is compared with the plain script, and
compared, where it is not, with a plain script that measures the same latency (200 rows a cell, at most 0.3 s).
What is remembered beyond one result folder, byte code by Python and digests of sources by tactbench, is warm from the
first turn on, as where either was used before; a cold run that has to read all sources anew stands beside.
Bounds, stated before measuring: cold at most the plain script and 0.3 s, cached at most 0.35 s.

benchopt 1.10 stands beside if its Python is named. It lives in an environment of its own::

    python -m venv peer && peer/bin/pip install benchopt==1.10.0 scikit-learn

Usage: python benchmarks/forest_peer.py [--rounds 5] [--benchopt peer/bin/python]
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trivial

from tactbench.core.recording.writer import write_recording
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import Block, ChannelSpec, SensorSpec, Source, StreamSpec

SETS, TREES, ROWS, TRAIN, FEATURES = 5, (5, 10, 20, 40), 300, 200, 20
COLD_S, CACHED_S = 0.3, 0.35

TASK = """
from tactbench.plugin import LabelTarget, TaskDescriptor, TaskSpec, hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_tasks():
    return [TaskDescriptor(spec=TaskSpec(
        name="which-class", title="Class", question="Which class?", kind="classification",
        target=LabelTarget(name="class"), metric="accuracy", protocols=("deployable",), splits=("roles",),
        estimators=("forest",), baselines=()))]
"""

PLAIN = """
import sys, time
import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import accuracy_score

arrays = np.load(sys.argv[1])
for number in range({sets}):
    X, y = arrays[f"X{{number}}"], arrays[f"y{{number}}"]
    for trees in {trees}:
        forest = RandomForestClassifier(trees, random_state=1).fit(X[:{train}], y[:{train}])
        print(number, trees, accuracy_score(y[{train}:], forest.predict(X[{train}:])))
        if sys.argv[2:] == ["latency"]:
            spent = []
            for place in np.linspace({train}, len(X) - 1, 201).astype(int):
                began = time.perf_counter()
                forest.predict(X[place : place + 1])
                spent.append(time.perf_counter() - began)
                if len(spent) >= 20 and sum(spent) > 0.3:
                    break
            print(*np.quantile(spent, (0.5, 0.95)))
"""

BENCHOPT = {
    "objective.py": """
from benchopt import BaseObjective
from sklearn.metrics import accuracy_score


class Objective(BaseObjective):
    name = "Forests"
    min_benchopt_version = "1.10"

    def set_data(self, X, y):
        self.X, self.y = X, y

    def get_objective(self):
        return dict(X=self.X[:{train}], y=self.y[:{train}])

    def evaluate_result(self, model):
        return dict(value=1 - accuracy_score(self.y[{train}:], model.predict(self.X[{train}:])))

    def get_one_result(self):
        return dict(model=None)
""",
    "datasets/made.py": """
import numpy as np
from benchopt import BaseDataset


class Dataset(BaseDataset):
    name = "Made"
    parameters = {{"number": list(range({sets}))}}

    def get_data(self):
        arrays = np.load({arrays!r})
        return dict(X=arrays[f"X{{self.number}}"], y=arrays[f"y{{self.number}}"])
""",
    "solvers/forest.py": """
from benchopt import BaseSolver
from sklearn.ensemble import RandomForestClassifier


class Solver(BaseSolver):
    name = "Forest"
    parameters = {{"trees": {trees}}}
    sampling_strategy = "run_once"

    def set_objective(self, X, y):
        self.X, self.y = X, y

    def run(self, _):
        self.model = RandomForestClassifier(self.trees, random_state=1).fit(self.X, self.y)

    def get_result(self):
        return dict(model=self.model)
""",
}

MATRIX = """
version: 1
rig: replay
recordings: shelf
latency: {latency}
tasks:
  - name: which-class
    estimators:
{estimators}
"""


def make(folder: Path) -> None:
    """Write the sets as arrays and as recordings, the task, the plain script and the matrix."""
    arrays = {}
    for number in range(SETS):
        rng = np.random.default_rng(number)
        y = rng.integers(0, 2, ROWS)
        X = rng.normal(size=(ROWS, FEATURES)) + np.outer(y, rng.normal(size=FEATURES) * 0.5)
        arrays |= {f"X{number}": X, f"y{number}": y}
        record(folder / "shelf", f"set{number}", "train", X[:TRAIN], y[:TRAIN])
        record(folder / "shelf", f"set{number}", "test", X[TRAIN:], y[TRAIN:])
    np.savez(folder / "arrays.npz", **arrays)
    (folder / "plain.py").write_text(PLAIN.format(sets=SETS, trees=TREES, train=TRAIN))
    about = folder / "tactbench_peer-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: tactbench-peer\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[tactbench]\npeer = tactbench_peer\n")
    (folder / "tactbench_peer.py").write_text(TASK)
    lines = "\n".join(f"      - {{name: forest, params: {{n_estimators: {trees}}}}}" for trees in TREES)
    for latency in ("true", "false"):
        (folder / f"latency-{latency}.yaml").write_text(MATRIX.format(latency=latency, estimators=lines))
    for name, text in BENCHOPT.items():
        path = folder / "peer" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.format(sets=SETS, trees=list(TREES), train=TRAIN, arrays=str(folder / "arrays.npz")))


def record(shelf: Path, name: str, role: str, X: np.ndarray, y: np.ndarray) -> None:
    """Write rows of one set as a recording."""
    channels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(FEATURES))
    streams = (StreamSpec(name="taxels", channels=channels),)
    sensor = SensorSpec(name=name, title=name, principle="none", streams=streams,
                        principle_source=Source(tag="assumed", reference="a benchmark"))  # fmt: skip
    about = RecordingMeta(name=f"{name}-{role}", sensor=sensor, rig="made", session=role, role=role)
    path = shelf / f"{name}-{role}.h5"
    path.parent.mkdir(parents=True, exist_ok=True)
    taxels = Block("taxels", np.arange(len(X), dtype=np.int64) * 10_000_000, X)
    write_recording(path, about, [taxels], {"taxels": {"class": np.asarray(y)}})


def seconds(command: list[str], folder: Path) -> float:
    """Return how long a process took; SystemExit with what it said if it failed."""
    began = time.perf_counter()
    done = subprocess.run(
        command, cwd=folder, env=trivial.with_byte_code(), stdin=subprocess.DEVNULL, capture_output=True, text=True
    )
    spent = time.perf_counter() - began
    if done.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return spent


def ways(folder: Path, benchopt: str | None) -> dict[str, tuple[list[str], Callable[[], None]]]:
    """Return every way: its command, and what to do before it."""

    def nothing() -> None:
        pass

    def forget(name: str) -> Callable[[], None]:
        return lambda: shutil.rmtree(folder / name, ignore_errors=True)

    def forget_peer() -> None:
        for name in ("__cache__", "outputs"):
            shutil.rmtree(folder / "peer" / name, ignore_errors=True)

    tactbench = [sys.executable, "-m", "tactbench", "run", "--config"]
    found = {
        "plain script": ([sys.executable, "plain.py", "arrays.npz"], nothing),
        "tactbench, cold": ([*tactbench, "latency-false.yaml", "--out", "out"], forget("out")),
        "tactbench, cached": ([*tactbench, "latency-false.yaml", "--out", "out"], nothing),
        "plain script, with latency": ([sys.executable, "plain.py", "arrays.npz", "latency"], nothing),
        "tactbench, cold, with latency": ([*tactbench, "latency-true.yaml", "--out", "timed"], forget("timed")),
    }
    if benchopt:
        run = [benchopt, "-m", "benchopt", "run", "peer", "-n", "1", "-r", "1", "--no-plot"]
        found |= {"benchopt, cold": (run, forget_peer), "benchopt, cached": (run, nothing)}
    return found


def main() -> None:
    """Measure every way in turn, and print the table and whether the bounds are kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--benchopt", metavar="PYTHON", help="the Python of an environment with benchopt 1.10")
    asked = parser.parse_args()
    os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        make(folder)
        trivial.use(folder)
        # As given: what a link in a virtual environment leads to is another Python.
        peer = str(Path(asked.benchopt).absolute()) if asked.benchopt else None
        commands = ways(folder, peer)
        spent: dict[str, list[float]] = {name: [] for name in commands}
        for turn in range(asked.rounds + 1):
            for name, (command, before) in commands.items():
                before()
                taken = seconds(command, folder)
                if turn:  # the first turn fills the disk's and Python's own caches
                    spent[name].append(taken)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{SETS * len(TREES)} forest cells, medians of {asked.rounds} whole processes, load {load:.1f} of "
          f"{os.cpu_count()}")  # fmt: skip
    middle = {name: statistics.median(times) for name, times in spent.items()}
    for name, times in spent.items():
        print(f"{name:<32}{middle[name]:.3f} s [{min(times):.3f}, {max(times):.3f}]")
    if not asked.benchopt:
        print("benchopt: left out; name the Python of an environment that has it with --benchopt")
    more = middle["tactbench, cold"] - middle["plain script"]
    timed = middle["tactbench, cold, with latency"] - middle["plain script, with latency"]
    print(f"cold beyond the plain script: {more:.3f} s (bound {COLD_S} s: {'kept' if more <= COLD_S else 'MISSED'})")
    print(f"the same where both measure latency: {timed:.3f} s")
    cached = middle["tactbench, cached"]
    print(f"cached: {cached:.3f} s (bound {CACHED_S} s: {'kept' if cached <= CACHED_S else 'MISSED'})")


if __name__ == "__main__":
    main()

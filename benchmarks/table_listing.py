"""How long it takes to list 1,000 finished cells again: the whole process, and each format in it.

    python benchmarks/table_listing.py [CELLS] [SESSIONS]

Made-up rows with replicates go through a real result folder; `tactbench leaderboard` is then run five times as a person
runs it, after once that ranks them. Printed are the medians, the first time, and what a bare `python -c pass` takes in
the same sitting; then the formats inside one process, and which heavy libraries the listing imported.
"""

from __future__ import annotations

import hashlib
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tactbench.core.leaderboard.formats import SUFFIXES, rendered
from tactbench.core.leaderboard.table import build_table
from tactbench.core.matrix.evaluate_cell import opening
from tactbench.core.matrix.plan import Cell
from tactbench.core.matrix.store import Row, Store
from tactbench.core.spec.task import LabelTarget, TaskSpec

REPEATS = 5
SENSORS = 20
HEAVY = ("numpy", "scipy", "sklearn", "h5py", "pyarrow", "matplotlib")


def made_up(cells: int, sessions: int) -> list[Row]:
    """Return rows of `SENSORS` sensors, in blocks of 100 cells."""
    rng = np.random.default_rng(1)
    rows = []
    for number in range(cells):
        task = TaskSpec(
            name=f"task{number // 100}", title="t", question="?", kind="regression", target=LabelTarget(name="y"),
            metric="rmse", unit="N", protocols=("deployable",), estimators=("lasso",), baselines=("mean",),
        )  # fmt: skip
        estimator = f"estimator{number // SENSORS % 5}"
        sensor = f"sensor{number % SENSORS}"
        cell = Cell(sensor, task.name, "twin", "deployable", "session", estimator, (), False, 1, 1, 1)
        squares = (1 + 0.01 * (number % 100) + 0.3 * rng.standard_normal(sessions)) ** 2
        score = float(np.sqrt(squares.mean()))
        rows.append(
            opening(cell, task)
            | {
                "status": "done", "score": score, "ci_low": score - 0.1, "ci_high": score + 0.1, "n_test": 1000,
                "n_sessions": sessions, "fit_s": 0.5, "predict_s": 1.0, "batch_rows": 1000, "latency_ms_p50": 0.02,
                "latency_ms_p95": 0.03, "simulated": True, "ci_method": "resampled sessions", "concurrency": 1,
                "assumptions": {f"assumed_{place}": place for place in range(20)},
                "key": hashlib.sha256(str(number).encode()).hexdigest()[:32],
                "replicates": {
                    "unit": "session", "names": [str(place) for place in range(sessions)], "strata": None,
                    "sums": [[10.0, 10.0 * float(square)] for square in squares],
                },
            }
        )  # fmt: skip
    return rows


def median(work: Callable[[], object]) -> float:
    """Return the median time of `REPEATS` calls in seconds."""
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def run(*arguments: str) -> str:
    """Run Python in a fresh process; return its stdout."""
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True).stdout


def main() -> None:
    """Print the times."""
    cells = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    sessions = int(sys.argv[2]) if len(sys.argv) > 2 else 12
    rows = made_up(cells, sessions)
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        with store.hold():
            store.begin({"host": "made up", "cpu": "none", "cores": 1})
            for row in rows:
                store.keep(row["key"], row, {})
        listing = ("-m", "tactbench", "leaderboard", folder)
        began = time.perf_counter()
        run(*listing)
        print(f"{cells} cells of {sessions} sessions, listed the first time: {time.perf_counter() - began:.2f} s")
        for shape in ("table", "md", "json", "csv", "latex"):
            print(f"listed again as {shape:<6} {median(lambda shape=shape: run(*listing, '--format', shape)):.2f} s")
        print(f"python -c pass         {median(lambda: run('-c', 'pass')):.2f} s")
        code = (
            "import sys\nfrom tactbench.core.cli import main\ntry:\n    main()\nexcept SystemExit:\n    pass\n"
            f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
        )
        done = subprocess.run([sys.executable, "-c", code, *listing[2:]], capture_output=True, text=True, check=True)
        print(f"imported while listing again: {done.stderr.strip().splitlines()[-1]}")
    table = build_table(rows)
    print(f"table from rows        {median(lambda: build_table(rows)) * 1e3:.0f} ms")
    for shape in SUFFIXES.values():
        print(f"{shape:<22} {median(lambda shape=shape: rendered(table, shape)) * 1e3:.0f} ms")


if __name__ == "__main__":
    main()

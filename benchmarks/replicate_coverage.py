"""How often the interval over eight replicates holds the long-run median, on the twin's own scores.

Records and answers 40 replicates of both sensors and both tasks, then draws groups of eight of them. The long-run
median is known from 40 replicates only: that of all, a fifth of which are the group's own (coverage too high), and that
of the 32 others, which are no truth either (too low). Both are printed; what is true lies between. Beside them, how
often the interval of a single campaign, over recordings or blocks of time within it, held another replicate's score.

Usage: python benchmarks/replicate_coverage.py [--replicates 40] [--groups 4000] [--out DIR]
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.core.statistics.replicates import median_interval

ASKED = {"force": ("lasso", "ols"), "curvature": ("forest-10", "logistic")}
SIZE = 8


def main() -> None:
    """Record, answer, and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--replicates", type=int, default=40)
    parser.add_argument("--groups", type=int, default=4000)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    matrix = MatrixSpec(
        seed=1, repeats=asked.replicates, sensors=("biotac", "icub"), latency=False,
        tasks=tuple(
            TaskChoice(name=task, protocol=("karl2016",), estimators=tuple(EstimatorChoice(name=one) for one in names))
            for task, names in ASKED.items()
        ),
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        rows = run_matrix(matrix, Store(asked.out or Path(folder))).rows
    cells = defaultdict(list)
    for row in rows:
        if row["status"] == "done" and not row["is_baseline"]:
            cells[row["cell"].rpartition("/")[0]].append(row)
    rng = np.random.default_rng(1)
    print(f"{'cell':<45} {'median':>8} {'all':>7} {'others':>7} {'one campaign':>13}")
    for name, found in cells.items():
        for key in ("score", "score_beyond_floor") if found[0]["score_beyond_floor"] is not None else ("score",):
            scores = np.array([row[key] for row in found])
            held, held_others = [], []
            for _ in range(asked.groups):
                chosen = rng.permutation(len(scores))
                known = median_interval(scores[chosen[:SIZE]].tolist())
                assert known is not None, "eight replicates have an interval"
                low, high = known
                held.append(low <= np.median(scores) <= high)
                held_others.append(low <= np.median(scores[chosen[SIZE:]]) <= high)
            ends = ("ci_low", "ci_high") if key == "score" else ("beyond_floor_ci_low", "beyond_floor_ci_high")
            single = [
                row[ends[0]] <= other[key] <= row[ends[1]]
                for row in found
                for other in found
                if row is not other and row[ends[0]] is not None
            ]
            label = name if key == "score" else f"{name}, beyond floor"
            print(f"{label:<45} {np.median(scores):8.4f} {np.mean(held):7.1%} {np.mean(held_others):7.1%} "
                  f"{np.mean(single):13.1%}")  # fmt: skip


if __name__ == "__main__":
    main()

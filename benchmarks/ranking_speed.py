"""How long ranks take: 50 tasks of 1,000 cells each, as on a large board.

Usage: python benchmarks/ranking_speed.py [--tasks 50] [--cells 1000] [--sessions 10]

Rows of either kind of metric, made by hand as an evaluation leaves them. Beside it, ranks without statistics: a sort by
score. Medians of five rounds; ranks of one block are a pure function of its rows, so a table may keep them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from tactbench.core.statistics.ranking import ranks


def block(rng: np.random.Generator, cells: int, sessions: int, classes: int) -> list[dict]:
    """Return the rows of one task."""
    names = [f"session-{place}" for place in range(sessions)]
    rows = []
    for place in range(cells):
        if classes:
            right = rng.binomial(100, 0.9 - 0.3 * place / cells, size=sessions)
            lines = [[0, int(hits), 1, 100 - int(hits)] for hits in right]
            score = float(right.sum() / (100 * sessions))
        else:
            squares = 100 * (1 + place / cells) * rng.gamma(20, 0.05, sessions)
            lines = [[float(value), 100] for value in squares]
            score = float(np.sqrt(squares.sum() / (100 * sessions)))
        kept = {"unit": "session", "names": names, "strata": None, "sums": lines}
        rows.append({
            "cell": f"{place}", "status": "done", "is_baseline": False, "score": score, "ci_low": None, "ci_high": None,
            "metric": "accuracy" if classes else "rmse", "classes": list(range(classes)), "equivalence": 0.01,
            "replicates": kept,
        })  # fmt: skip
    return rows


def median_s(work: Callable[[], object]) -> float:
    """Return the median of five rounds, seconds."""
    took = []
    for _ in range(5):
        began = time.perf_counter()
        work()
        took.append(time.perf_counter() - began)
    return float(np.median(took))


def main() -> None:
    """Print one line a kind of metric."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=int, default=50)
    parser.add_argument("--cells", type=int, default=1000)
    parser.add_argument("--sessions", type=int, default=10)
    given = parser.parse_args()
    rng = np.random.default_rng(1)
    for name, classes in (("rmse", 0), ("accuracy of 5 classes", 5)):
        blocks = [block(rng, given.cells, given.sessions, classes) for _ in range(given.tasks)]
        ranks(blocks[0])  # imports
        ours = median_s(lambda some=blocks: [ranks(rows) for rows in some])
        plain = median_s(lambda some=blocks: [sorted(rows, key=lambda row: row["score"]) for rows in some])
        print(f"{name}: {given.tasks} x {given.cells} cells x {given.sessions} sessions: {ours:.2f} s "
              f"({1e3 * ours / given.tasks:.1f} ms a task); sorted by score only: {plain:.3f} s")  # fmt: skip


if __name__ == "__main__":
    main()

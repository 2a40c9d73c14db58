"""Whether a cell's times stay clean in a process of its own, and while the engine is busy beside it.

The forest cells of forest_peer.py (300 rows by 20 features, the latency of single rows measured), isolated, one at a
time: as the engine does it where it has a core to spare ("beside"), and as it does it where it has none, when it waits
for the end of every process and forks the next one only then ("alone"). And in one process after the other ("reused"):
there the pages that a fork copies when they are first written to have been copied by the cells before. Whole matrices
in new folders, turn and turn about. For each cell the ratio of its medians over the rounds, and of its minima, which a
busy machine disturbs least; printed are the median and the deciles of those ratios.

Usage: OMP_NUM_THREADS=1 python benchmarks/clean_times.py [ROUNDS [REPEATS]]
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import forest_peer
import trivial

from tactbench.core.matrix.engines import cores
from tactbench.core.matrix.engines.choice import EngineChoice, EngineName
from tactbench.core.matrix.pool.processes import can_fork
from tactbench.core.matrix.run import carry_out
from tactbench.core.matrix.store import Store
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice

TIMES = ("fit_s", "latency_ms_p50", "latency_ms_p95", "wall_s")


def matrix(repeats: int) -> MatrixSpec:
    """Return forests of several sizes on every set."""
    forests = tuple(EstimatorChoice(name="forest", params={"n_estimators": trees}) for trees in forest_peer.TREES)
    return MatrixSpec(
        rig="replay", repeats=repeats, tasks=(TaskChoice(name="which-class", split="roles", estimators=forests),)
    )


def main() -> None:
    """Run the rounds and print the table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    repeats = int(sys.argv[2]) if len(sys.argv) > 2 else 2
    if not can_fork():
        sys.exit("This process has threads: set OMP_NUM_THREADS=1.")
    ways: dict[str, tuple[EngineName, Callable[[], int]]] = {
        "beside": ("isolated", cores.cores), "alone": ("isolated", lambda: 1), "reused": ("in-process", lambda: 1)
    }  # fmt: skip
    found: dict[str, dict[tuple[str, str], list[float]]] = {name: defaultdict(list) for name in ways}
    whole: dict[str, list[float]] = {name: [] for name in ways}
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        forest_peer.make(folder)
        trivial.use(folder)
        for turn in range(rounds + 1):
            for name in sorted(ways, reverse=bool(turn % 2)):
                engine, cores.cores = ways[name]
                began = time.perf_counter()
                with Store(folder / f"{name}-{turn}").hold() as store:
                    rows = carry_out(matrix(repeats), store, choice=EngineChoice(engine),
                                     recordings=folder / "shelf").rows  # fmt: skip
                spent = time.perf_counter() - began
                assert all(row["status"] == "done" for row in rows), [row["reason"] for row in rows]
                if turn:  # the first turn imports
                    whole[name].append(spent / len(rows))
                    for row in rows:
                        for time_of in TIMES:
                            found[name][row["cell"], time_of].append(row[time_of])
    print(f"cores {os.cpu_count()}, load {os.getloadavg()[0]:.1f}, {len(rows)} cells, medians of {rounds} rounds")
    for one, other in (("beside", "alone"), ("alone", "reused")):
        for time_of in TIMES:
            for kind, of in (("medians", statistics.median), ("minima", min)):
                ratios = [of(found[one][key]) / of(times) for key, times in found[other].items() if key[1] == time_of]
                low, *_, high = statistics.quantiles(ratios, n=10)
                middle = statistics.median(ratios)
                print(f"{time_of:<15}{kind:<8} {one} / {other} {middle:.3f} [{low:.3f}, {high:.3f}]")
    for name, times in whole.items():
        print(f"a cell of the run, {name:<7} {1e3 * statistics.median(times):.1f} ms")


if __name__ == "__main__":
    main()

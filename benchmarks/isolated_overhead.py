"""What isolation costs a cell: the process pool against a bare fork and pipe, and against a reused process.

The process first imports what cells share (scikit-learn), as a run does. Then trivial cells, turn and turn about: bare
``os.fork`` with a pipe, written in ten lines; a pool with a process for each cell, with and without limits; a pool that
reuses one. Prints medians over rounds, and the ratio to the bare fork. Bound: 40 ms per trivial cell after preload.

Usage: OMP_NUM_THREADS=1 python benchmarks/isolated_overhead.py [ROUNDS [CELLS]]
"""

from __future__ import annotations

import os
import pickle
import statistics
import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

from tactbench.core.pool.limits import Limits
from tactbench.core.pool.pool import Pool
from tactbench.core.pool.processes import can_fork

BOUND_MS = 40.0


def cell(number: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a row as large as a real one, with nothing computed for it."""
    return {"cell": f"trivial/{number}", "status": "done", **{f"key {n}": float(n) for n in range(70)}}, {}


def bare(items: Iterable[int]) -> int:
    """Fork, compute, send by a pipe, wait: nothing is guarded."""
    heard = 0
    for item in items:
        reading, writing = os.pipe()
        pid = os.fork()
        if pid == 0:
            with os.fdopen(writing, "wb") as pipe:
                pipe.write(pickle.dumps(cell(item)))
            os._exit(0)
        os.close(writing)
        with os.fdopen(reading, "rb") as pipe:
            heard += pickle.loads(pipe.read())[0]["status"] == "done"
        os.waitpid(pid, 0)
    return heard


def by(engine: Pool) -> Callable[[Iterable[int]], int]:
    """Return a timed_estimator that has an engine carry out the cells."""
    return lambda items: sum(not isinstance(outcome, BaseException) for _, outcome in engine.each(cell, items))


def main() -> None:
    """Run the rounds and print the table; exit 1 if the bound is missed."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    cells = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    import h5py  # noqa: F401
    import sklearn.ensemble
    import sklearn.linear_model  # noqa: F401

    if not can_fork():
        sys.exit("This process has threads: set OMP_NUM_THREADS=1.")
    limits = Limits(timeout_s=60.0, memory_mb=4096)
    timed_estimators = {
        "bare fork and pipe": bare,
        "isolated": by(Pool(1)),
        "isolated, limited": by(Pool(1, limits)),
        "reused process": by(Pool(1, limits, reuse=True)),
    }
    spent: dict[str, list[float]] = {name: [] for name in timed_estimators}
    for _ in range(rounds):
        for name, run in timed_estimators.items():
            began = time.perf_counter()
            assert run(range(cells)) == cells
            spent[name].append(1e3 * (time.perf_counter() - began) / cells)
    print(f"cores {os.cpu_count()}, rounds {rounds}, {cells} cells a round; median [min, max], ms per trivial cell")
    for name, times in spent.items():
        ratio = statistics.median(a / b for a, b in zip(times, spent["bare fork and pipe"], strict=True))
        print(
            f"{name:<20} {statistics.median(times):7.3f} [{min(times):.3f}, {max(times):.3f}]   x {ratio:.2f} of bare"
        )
    worst = max(statistics.median(spent[name]) for name in ("isolated", "isolated, limited"))
    print(f"bound {BOUND_MS:g} ms: {'kept' if worst <= BOUND_MS else 'MISSED'}")
    sys.exit(worst > BOUND_MS)


if __name__ == "__main__":
    main()

"""What a run costs in which nothing is new, and what its parts cost: keys, memories, the registry, provenance.

Whole processes are timed turn and turn about with an empty Python and with one that imports click, in the same sitting;
the first cached run is thrown away. Parts are timed inside one process.

Usage: python benchmarks/cached_path.py [ROUNDS]
"""

from __future__ import annotations

import gc
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

CELLS = 20
GOAL_PROCESS_S, GOAL_KEY_S, GOAL_PROVENANCE_S = 0.35, 20e-6, 0.040
"""Stated before measuring, for an idle machine."""

MATRIX = """
version: 1
seed: 1
repeats: 5
rig: twin
sensors: [ideal]
tasks:
  - {name: force, protocol: deployable, estimators: [ols, {name: lasso, params: {lambda_: 0.2}}]}
"""


def median_s(call: Callable[[], object], rounds: int) -> float:
    """Return the median of so many calls, seconds."""
    taken = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        taken.append(time.perf_counter() - start)
    return statistics.median(taken)


def processes(rounds: int) -> None:
    """Time whole processes."""
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "matrix.yaml").write_text(MATRIX)
        run = [sys.executable, "-m", "tactbench", "run", "--config", "matrix.yaml", "--out", "out", "--format", "csv"]
        ways = {
            "empty Python": [sys.executable, "-c", ""],
            "Python importing click": [sys.executable, "-c", "import click"],
            f"{CELLS} cached cells": run,
        }

        # Byte code is kept, as it is for everybody: some machines switch that off for tests.
        env = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        env["PYTHONPYCACHEPREFIX"] = str(Path(place) / "byte code")

        def call(command: list[str]) -> None:
            subprocess.run(command, cwd=place, env=env, capture_output=True, check=True)

        call(run)
        call(run)
        taken: dict[str, list[float]] = {name: [] for name in ways}
        for _ in range(rounds):
            for name, command in ways.items():
                taken[name].append(median_s(lambda command=command: call(command), 1))
    found = {name: statistics.median(values) for name, values in taken.items()}
    for name, seconds in found.items():
        ratio = seconds / found["Python importing click"]
        print(f"{name:26} {seconds:.3f} s ({min(taken[name]):.3f} - {max(taken[name]):.3f}), {ratio:.1f} x click")
    print(f"  goal: {GOAL_PROCESS_S} s for {CELLS} cached cells\n")


def parts(rounds: int) -> None:
    """Time the parts of a cached run in this process."""
    gc.set_threshold(100_000, 50, 100)  # as the command line does
    from tactbench.core.matrix.keys import Keys
    from tactbench.core.matrix.plan import Cell
    from tactbench.core.plugins.registry import installed, load_registry
    from tactbench.core.provenance.gather import gather

    print(f"registry, loaded once more  {1e3 * median_s(load_registry, rounds):.1f} ms")
    cell = Cell("ideal", "force", "twin", "deployable", None, "lasso", (("lambda_", 0.2),), False, 1, 1, 1)
    data = [f"{number:064x}" for number in range(60)]

    def first() -> Keys:
        keys = Keys(installed())
        keys.of_cell(cell, data)
        return keys

    cold = median_s(first, rounds)
    keys = first()

    def thousand() -> None:
        for _ in range(1000):
            keys.of_cell(cell, list(data))

    each = median_s(thousand, rounds) / 1000
    print(f"first key                   {1e3 * cold:.1f} ms")
    print(f"every further key           {1e6 * each:.1f} us (goal {1e6 * GOAL_KEY_S:.0f} us, 60 recordings)")
    spent = median_s(lambda: gather(keys.sources), rounds)
    print(f"provenance                  {1e3 * spent:.1f} ms (goal {1e3 * GOAL_PROVENANCE_S:.0f} ms)")


def main() -> None:
    """Print everything."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    processes(rounds)
    parts(rounds)


if __name__ == "__main__":
    main()

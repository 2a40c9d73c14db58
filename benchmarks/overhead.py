"""What the matrix adds to a cell: cold and found finished, for 100, 1,000 and 10,000 cells that do nothing.

Every round and size is a process of its own, and its cells are carried out as ``--engine in-process`` does: one after
the other, several of them each in a forked process of its own. It carries out the matrix cold, lists it again finished,
and then calls `evaluate` for the same cells in a plain loop: what the matrix took beyond that is what it adds. Latency
of single rows is not measured (``latency: false``). The slope is what one more cell costs, between two sizes; what is
left at no cells is the fixed cost of a run (provenance, digests of source). Bounds, stated before measuring: 5 ms a
cold cell, 2 ms one found finished, and slopes that differ by less than 1.3.

Usage: python benchmarks/overhead.py [--rounds 5] [--sizes 100,1000,10000] [--on DIR]
"""

from __future__ import annotations

import argparse
import gc
import itertools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tactbench.core.cli.threads import keep_threads

keep_threads()  # as the command line does, before numpy is imported: a process with threads cannot fork its cells

import trivial  # noqa: E402

COLD_MS, CACHED_MS, RATIO = 5.0, 2.0, 1.3


def one(cells: int, on: str | None) -> dict[str, float]:
    """Measure one size once, seconds."""
    gc.set_threshold(100_000, 50, 100)  # as the command line does
    with tempfile.TemporaryDirectory(dir=on) as made:
        folder = Path(made)
        shelf = trivial.install(folder / "plugin")
        trivial.use(folder / "plugin")
        from tactbench.core.evaluation.cell import CellContext, evaluate_cell
        from tactbench.core.evaluation.dataset import load_dataset
        from tactbench.core.matrix.engine import EngineChoice
        from tactbench.core.matrix.run import run_matrix
        from tactbench.core.matrix.store import Store
        from tactbench.core.plugins.registry import installed
        from tactbench.core.pool.in_process import InProcess

        choice = EngineChoice("in-process")
        forked = not isinstance(choice.engine(cells), InProcess)
        run_matrix(trivial.matrix(3), Store(folder / "warm"), choice=choice, recordings=shelf)  # imports
        found = {"forked": float(forked)}
        for name in ("cold", "cached"):
            began = time.perf_counter()
            outcome = run_matrix(trivial.matrix(cells), Store(folder / "out"), choice=choice, recordings=shelf)
            found[name] = time.perf_counter() - began
            assert [row["status"] for row in outcome.rows] == ["done"] * cells
            assert outcome.computed == (cells if name == "cold" else 0)
        task = installed().tasks["nothing-asked"].spec
        data = load_dataset(task, sorted(shelf.glob("*.h5")))
        began = time.perf_counter()
        for seed in range(1, cells + 1):
            evaluate_cell(
                CellContext(
                    task,
                    installed().estimators["nothing"],
                    {},
                    "deployable",
                    "session",
                    seed=seed,
                    clock=time.perf_counter,
                    latency=False,
                ),
                data,
            )
        found["plain"] = time.perf_counter() - began
    return found


def main() -> None:
    """Measure every size in turn, and print the table and whether the bounds are kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--sizes", default="100,1000,10000")
    parser.add_argument("--on", metavar="DIR", help="a folder on the disk to measure with; default: the temporary one")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(one(asked.one, asked.on)))
        return
    sizes = [int(size) for size in asked.sizes.split(",")]
    rounds: dict[int, list[dict[str, float]]] = {size: [] for size in sizes}
    for _ in range(asked.rounds):
        for size in sizes:
            command = [sys.executable, __file__, "--one", str(size), *(["--on", asked.on] if asked.on else [])]
            done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=trivial.with_byte_code())
            rounds[size].append(json.loads(done.stdout))
    # Added: the difference to the plain loop of the same round.
    added = {size: statistics.median(one["cold"] - one["plain"] for one in rounds[size]) for size in sizes}
    cached = {size: statistics.median(one["cached"] for one in rounds[size]) for size in sizes}
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    where = "forked processes" if rounds[sizes[0]][0]["forked"] else "the run's process"
    print(f"medians of {asked.rounds} rounds, cells in {where}, load {load:.1f} on {os.cpu_count()} cores; ms a cell")
    print(f"{'cells':>7}{'whole, cold':>13}{'plain loop':>12}{'added':>8}{'cached':>8}")
    for size in sizes:
        whole, plain = (1e3 * statistics.median(one[name] for one in rounds[size]) / size for name in ("cold", "plain"))
        print(f"{size:>7}{whole:>13.3f}{plain:>12.3f}{1e3 * added[size] / size:>8.3f}"
              f"{1e3 * cached[size] / size:>8.3f}")  # fmt: skip
    for name, spent, bound in (("cold, added", added, COLD_MS), ("cached", cached, CACHED_MS)):
        slopes = [1e3 * (spent[b] - spent[a]) / (b - a) for a, b in itertools.pairwise(sizes)]
        if not slopes:
            continue
        fixed = 1e3 * spent[sizes[0]] - slopes[0] * sizes[0]
        kept = "kept" if slopes[-1] <= bound else "MISSED"
        print(f"{name}: one more cell {', '.join(f'{slope:.3f}' for slope in slopes)} ms, at no cells {fixed:.0f} ms "
              f"(bound {bound} ms: {kept})")  # fmt: skip
        if len(slopes) > 1:
            ratio = slopes[-1] / slopes[-2]
            print(f"  ratio of slopes {ratio:.2f} (bound {RATIO}: {'kept' if ratio < RATIO else 'MISSED'})")


if __name__ == "__main__":
    main()

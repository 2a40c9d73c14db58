"""Listing a thousand finished cells again: `tactbench run` on a finished matrix, and `tactbench leaderboard`.

Whole processes, median of the rounds; beside them a Python that only starts. The bound, stated before measuring, is one
second for each.

Usage: python benchmarks/relisting.py [--rounds 5] [--cells 1000]
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import trivial

BOUND_S = 1.0


def seconds(command: list[str], folder: Path) -> float:
    """Return how long a process took."""
    began = time.perf_counter()
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - began


def main() -> None:
    """Measure, and print the table and whether the bound is kept."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cells", type=int, default=1000)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        shelf = trivial.install(folder / "plugin")
        trivial.use(folder / "plugin")
        tactbench = [sys.executable, "-m", "tactbench"]
        run = [*tactbench, "run", "--task", "nothing-asked", "--estimator", "nothing", "--recordings", str(shelf),
               "--repeats", str(asked.cells), "--no-latency", "--out", "out"]  # fmt: skip
        first = seconds(run, folder)
        commands = {
            "a Python that starts": [sys.executable, "-c", "pass"],
            "tactbench run, again": run,
            "tactbench leaderboard": [*tactbench, "leaderboard", "out"],
            "tactbench leaderboard --format json": [*tactbench, "leaderboard", "out", "--format", "json"],
        }
        spent: dict[str, list[float]] = {name: [] for name in commands}
        for _ in range(asked.rounds):
            for name, command in commands.items():
                spent[name].append(seconds(command, folder))
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{asked.cells} cells, first run {first:.1f} s; {asked.rounds} rounds, load {load:.1f} of {os.cpu_count()}")
    for name, times in spent.items():
        middle = statistics.median(times)
        verdict = "" if name.startswith("a ") else f" (bound {BOUND_S} s: {'kept' if middle <= BOUND_S else 'MISSED'})"
        print(f"{name:<36} {middle:.3f} s [{min(times):.3f}, {max(times):.3f}]{verdict}")


if __name__ == "__main__":
    main()

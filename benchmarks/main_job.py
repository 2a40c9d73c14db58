"""What the main job costs over a plain script, and what a second run costs.

``tactbench run --sensor biotac --task curvature`` in an empty folder, against ``plain_forest.py`` on the very arrays
that the job makes for the forest of each of its replicates, turn and turn about. Prints medians over rounds and their
ratio.

Usage: python benchmarks/main_job.py [ROUNDS]
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

SENSOR, TASK = "biotac", "curvature"
HERE = Path(__file__).resolve().parent
TACTBENCH = [str(Path(sys.executable).with_name("tactbench"))]


def timed(command: list[str], folder: Path) -> tuple[float, str]:
    """Return wall seconds of a whole process and its standard output."""
    began = time.perf_counter()
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return time.perf_counter() - began, done.stdout


def job(out: str) -> list[str]:
    """Return the main job's command."""
    return [*TACTBENCH, "run", "--sensor", SENSOR, "--task", TASK, "--out", out, "--format", "json"]


def arrays_of(out: Path, folder: Path) -> list[str]:
    """Write the arrays that the paper's protocol makes of each replicate's recordings; return seeds and files."""
    from tactbench.core.evaluation.dataset import load_dataset
    from tactbench.core.evaluation.protocols import KARL2016
    from tactbench.core.evaluation.sets import FeatureScale, keep, moments, part
    from tactbench.core.evaluation.splits import make_splits
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.registry import load_registry

    task = load_registry().tasks[TASK].spec
    said = []
    for row in Store(out).rows():
        if row["estimator"] != "forest":
            continue
        data = load_dataset(task, [out / path for path in row["recordings"]])
        (assignment,) = make_splits(data, "roles", row["seed"])
        made = {}
        for role in ("train", "validation", "test"):
            kept = keep(data, KARL2016, getattr(assignment, role), role, Counter())
            one = part(kept, FeatureScale(*moments(kept.X)), 0)
            made[f"X_{role}"], made[f"y_{role}"] = one.X, one.y
        np.savez(folder / f"arrays{row['seed']}.npz", **made)
        said += [f"arrays{row['seed']}.npz", str(row["seed"])]
    return said


def main() -> None:
    """Run the rounds and print the table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _, text = timed(job("warm"), folder)
        (row,) = [row for row in json.loads(text) if row["estimator"] == "forest"]
        plain = [sys.executable, str(HERE / "plain_forest.py"), *arrays_of(folder / "warm", folder)]
        _, said = timed(plain, folder)
        ours = ", ".join(f"{score:.6f}" for score in row["replicate_scores"])
        print(f"tactbench: macro F1 test {ours}; plain script: {said.strip()}")
        assert [f"{score:.6f}" for score in row["replicate_scores"]] == said.split(), "the two must do the same work"
        cold, script, cached = [], [], []
        for number in range(rounds):
            cold.append(timed(job(f"cold{number}"), folder)[0])
            script.append(timed(plain, folder)[0])
            cached.append(timed(job(f"cold{number}"), folder)[0])
    print(f"cores {os.cpu_count()}, rounds {rounds}; median [min, max] of whole processes, seconds")
    for label, times in (("main job, cold", cold), ("plain script", script), ("main job, all cached", cached)):
        print(f"{label:<22} {statistics.median(times):6.2f} [{min(times):.2f}, {max(times):.2f}]")
    ratios = [a / b for a, b in zip(cold, script, strict=True)]
    print(f"cold / plain, pair by pair: {statistics.median(ratios):.2f} [{min(ratios):.2f}, {max(ratios):.2f}]")


if __name__ == "__main__":
    main()

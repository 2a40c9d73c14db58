"""What recordings cost: fifteen from a cold process, one after another in a warm one, and with a table at hand.

The curvature task's scenes (five caps in three roles, every recording with its own placement and 5000 samples), one
thread. Cold: a new process from its first import to its last block, wall seconds, median of the rounds. Own contact:
every recording solves its own load table, as the paper's plan has it. Same contact: the table is there and only noise
is drawn anew. Beside each speed stands the error of that point (against a skin of 144 x 192 or 176 x 192 cells, see
twin_convergence.py). With the path of another checkout, its default is measured turn and turn about for a ratio.

Usage: python benchmarks/twin_speed.py [ROUNDS] [OTHER_CHECKOUT]
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
POINTS = {
    "coarse": {"most_nodes": 9, "table_tolerance_factor": 12.0},
    "default": {},
    "finer": {"cells_factor": 1.5, "most_nodes": 20, "table_tolerance_factor": 3.0},
}
"""Fidelity points of the front, coarse to fine."""

# What one process does. It prints seconds: cold, own contacts (per recording), same contacts (per recording).
CHILD = """
import sys, time
began = time.perf_counter()
import json
from tactbench.core.plugins.registry import load_registry
from tactbench.rigs.twin import tactbench_effects
from tactbench.rigs.twin.rig import Twin
registry = load_registry()
name, changed, warm = sys.argv[1], json.loads(sys.argv[2]), sys.argv[3] == "warm"
rig = Twin(tuple(tactbench_effects()))
sensor, scenes = registry.sensors[name], [planned.scene for planned in registry.tasks["curvature"].spec.scenes]
if changed:
    import dataclasses
    from tactbench.core.spec.scene import Simulation
    from tactbench.rigs.twin.synthesis import DEFAULT, RUNGS
    RUNGS["point"] = dataclasses.replace(DEFAULT, **changed)
    scenes = [scene.simulated_as(Simulation(rung="point")) for scene in scenes]
def record(seed):
    start = time.perf_counter()
    for scene in scenes:
        with rig.open(sensor, scene, seed=seed) as acquisition:
            for _ in acquisition:
                pass
    return (time.perf_counter() - start) / len(scenes)
record(1)
said = {"cold": time.perf_counter() - began}
if warm:
    said["own"] = min(record(2), record(3))
    said["same"] = min(record(3) for _ in range(3))
print(json.dumps(said))
"""


def child(folder: Path, sensor: str, changed: dict[str, float], *, warm: bool) -> dict[str, float]:
    """Return what a fresh single-threaded process prints."""
    threads = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {**os.environ, **dict.fromkeys(threads, "1"), "PYTHONPATH": str(folder)}
    command = [sys.executable, "-c", CHILD, sensor, json.dumps(changed), "warm" if warm else "cold"]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def errors() -> dict[tuple[str, str], float]:
    """Return the relative rms error of each sensor and point, load table included."""
    import dataclasses

    import numpy as np
    import twin_convergence as convergence

    found = {}
    for spec in (convergence.BIOTAC, convergence.ICUB):
        _, finest = convergence.rows(spec)[-1]
        reference = convergence.changes(spec, finest)
        for point, changed in POINTS.items():
            change = convergence.changes(spec, dataclasses.replace(convergence.DEFAULT, **changed), table=True)
            found[spec.name, point] = float(np.sqrt(np.mean((change - reference) ** 2) / np.mean(reference**2)))
    return found


def main() -> None:
    """Run the rounds and print one table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    other = Path(sys.argv[2]).resolve() if len(sys.argv) > 2 else None
    own = HERE.parent
    error = errors()
    print(f"cores {os.cpu_count()}, rounds {rounds}, one thread; medians [least]")
    print(
        f"{'sensor, point':<20}{'error %':>9}{'15 recordings cold, s':>24}"
        f"{'own contact, samples/s':>26}{'same contact, samples/s':>26}"
    )
    for sensor in ("biotac", "icub"):
        for point, changed in POINTS.items():
            said, beside = [], []
            for _ in range(rounds):
                said.append(child(own, sensor, changed, warm=True))
                if other is not None and point == "default":
                    beside.append(child(other, sensor, {}, warm=True))
            print(row(f"{sensor}, {point}", f"{100 * error[sensor, point]:.2f}", said))
            if beside:
                print(row(f"{sensor}, other", "", beside))
                ratios = {
                    key: statistics.median(b[key] / a[key] for a, b in zip(said, beside, strict=True))
                    for key in said[0]
                }
                print(f"  other/own: cold {ratios['cold']:.2f}, own contact {ratios['own']:.2f}")


def row(label: str, error: str, said: list[dict[str, float]]) -> str:
    """Return one line of the table."""
    cold = [one["cold"] for one in said]
    own, same = ([5000 / one[key] for one in said] for key in ("own", "same"))
    return (
        f"{label:<20}{error:>9}{f'{statistics.median(cold):.2f} [{min(cold):.2f}]':>24}"
        f"{f'{statistics.median(own):.0f} [most {max(own):.0f}]':>26}"
        f"{f'{statistics.median(same):.0f} [most {max(same):.0f}]':>26}"
    )


if __name__ == "__main__":
    main()

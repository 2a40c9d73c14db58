"""What a cell costs on Dask beside what it costs isolated, and whether workers grow.

Trivial cells (a function that returns its argument) through both engines, turn and turn about, two at once: the time of
many cells less that of a few, by the number between, so that starting up does not count. Prints medians over rounds,
their ratio, what starting a local cluster of two workers costs, and the memory of workers and their fork servers after
the first and after the last round.

Usage: python benchmarks/dask_cells.py [CELLS] [ROUNDS]
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

from tactbench.core.matrix.dask import Dask, client_of  # noqa: E402
from tactbench.core.pool.limits import Limits  # noqa: E402
from tactbench.core.pool.pool import Pool  # noqa: E402

JOBS, FEW = 2, 10
LIMITS = Limits(timeout_s=60.0)


def work(number: int, concurrency: int = 1) -> int:
    """Return the number it is given."""
    return number


def seconds(engine: Any, cells: int) -> float:
    """Return the seconds that an engine needs for so many cells; every answer is checked."""
    began = time.perf_counter()
    outcomes = list(engine.each(work, range(cells)))
    spent = time.perf_counter() - began
    assert sorted(outcomes) == [(number, number) for number in range(cells)]
    return spent


def per_cell_ms(engine: Any, cells: int) -> float:
    """Return what one more cell costs, ms."""
    few = seconds(engine, FEW)
    return 1e3 * (seconds(engine, cells + FEW) - few) / cells


def below(pid: int) -> list[int]:
    """Return the processes below one."""
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in map(int, (task / "children").read_text().split()):
            found += [child, *below(child)]
    return found


def resident_mb() -> dict[str, float]:
    """Return the largest resident memory among workers and among fork servers, MB."""
    most = {"worker": 0.0, "fork server": 0.0}
    for pid in below(os.getpid()):
        said = Path(f"/proc/{pid}/cmdline").read_text()
        kind = "fork server" if "forkserver" in said else "worker" if "spawn_main" in said else ""
        if kind:
            pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
            most[kind] = max(most[kind], pages * os.sysconf("SC_PAGE_SIZE") / 2**20)
    return most


def isolated_ms(cells: int) -> float:
    """Return what one more cell costs isolated, ms: measured in a process without a Dask client, as it is used."""
    done = subprocess.run(
        [sys.executable, __file__, "isolated", str(cells)], capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def main(cells: int, rounds: int) -> None:
    """Measure and print."""
    isolated, dask, memory = [], [], []
    began = time.perf_counter()
    with client_of(None, JOBS) as client:
        engine = Dask(JOBS, LIMITS, client.scheduler.address)
        seconds(engine, JOBS)
        start_s = time.perf_counter() - began
        for _ in range(rounds):
            isolated.append(isolated_ms(cells))
            dask.append(per_cell_ms(engine, cells))
            memory.append(resident_mb())
    here, there = statistics.median(isolated), statistics.median(dask)
    print(f"{JOBS} at once, {cells} trivial cells a round, {rounds} rounds: median (least to most), ms a cell")
    print(f"  isolated  {here:6.2f}  ({min(isolated):.2f} to {max(isolated):.2f})")
    print(f"  dask      {there:6.2f}  ({min(dask):.2f} to {max(dask):.2f})   {there / here:.2f} times as much")
    print(f"  a local cluster of {JOBS} workers until its first answers: {start_s:.2f} s")
    for kind in memory[0]:
        first, last = memory[0][kind], memory[-1][kind]
        print(f"  largest {kind}: {first:.1f} MB after round 1, {last:.1f} MB after round {rounds}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["isolated"]:
        print(per_cell_ms(Pool(JOBS, LIMITS), int(sys.argv[2])))
    else:
        main(*(int(word) for word in (*sys.argv[1:], *("300", "5")[len(sys.argv) - 1 :])))

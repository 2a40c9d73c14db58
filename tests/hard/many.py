"""Random hard cases of contact, memory, channels and evaluation, each held against a written right answer.

Every case runs in a worker process under a time limit of its own: one that does not come back is stopped and counted as
a hang. A case passes, is refused with an explanation, or fails; a failure is printed with the command that repeats it.
Exit status 1 if any failed.

Usage: python -m tests.hard.many [N] [--seed S] [--workers W] [--limit SECONDS] [--only TEXT] [--case NUMBER]

With --only, families whose name holds TEXT; with --case as well, that one case of each.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from tests.hard.cases import judge
from tests.hard.families import families

WARM_UP_S = 120.0
"""Time a worker may take for its first imports."""


def work(pipe: Connection) -> None:
    """Judge what comes down the pipe until None does."""
    found = families()
    pipe.send("ready")
    while (job := pipe.recv()) is not None:
        name, seed, number = job
        began = time.perf_counter()
        outcome = judge(name, found[name], seed, number)
        pipe.send((outcome.verdict, outcome.detail, outcome.drawn, time.perf_counter() - began))


@dataclass
class Worker:
    """One process, what it is doing and until when it may."""

    process: Any
    pipe: Connection
    job: tuple[str, int, int] | None = None
    until: float = 0.0

    @classmethod
    def start(cls) -> Worker:
        """Start a process and wait until it has imported everything."""
        here, there = multiprocessing.get_context("spawn").Pipe()
        process = multiprocessing.get_context("spawn").Process(target=work, args=(there,), daemon=True)
        process.start()
        if not here.poll(WARM_UP_S):
            raise SystemExit("A worker did not start.")
        here.recv()
        return cls(process, here)

    def give(self, job: tuple[str, int, int], limit_s: float) -> None:
        """Hand over a case."""
        self.job, self.until = job, time.monotonic() + limit_s
        self.pipe.send(job)

    def stop(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()
        self.pipe.close()


Judged = tuple[tuple[str, int, int], str, str, dict[str, Any], float]


def judged(jobs: Iterator[tuple[str, int, int]], workers: int, limit_s: float) -> Iterator[Judged]:
    """Yield every job with verdict, detail, what was drawn and seconds."""
    crew = [Worker.start() for _ in range(workers)]
    for worker in crew:
        if (job := next(jobs, None)) is not None:
            worker.give(job, limit_s)
    while any(worker.job for worker in crew):
        busy = [worker for worker in crew if worker.job]
        patience = max(0.0, min(worker.until for worker in busy) - time.monotonic())
        ready = wait([worker.pipe for worker in busy], timeout=patience)
        for place, worker in enumerate(crew):
            if worker.job is None:
                continue
            if worker.pipe in ready:
                try:
                    verdict, detail, drawn, seconds = worker.pipe.recv()
                except EOFError:
                    verdict, detail, drawn, seconds = "failed", "the process died", {}, 0.0
            elif time.monotonic() >= worker.until:
                verdict, detail, drawn, seconds = "failed", f"hangs: no answer within {limit_s:g} s", {}, limit_s
            else:
                continue
            yield worker.job, verdict, detail, drawn, seconds
            worker.job = None
            if detail.startswith("hangs") or detail == "the process died":
                worker.stop()
                crew[place] = worker = Worker.start()
            if (job := next(jobs, None)) is not None:
                worker.give(job, limit_s)
    for worker in crew:
        worker.stop()


def main() -> int:
    """Run and print."""
    # One thread a worker: the cases are small, and linear algebra on all cores would only wait for itself.
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(threads, "1")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="?", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--limit", type=float, default=120.0)
    parser.add_argument("--only", default="")
    parser.add_argument("--case", type=int)
    asked = parser.parse_args()
    names = [name for name in families() if asked.only in name]
    if not names:
        parser.error(f"no family's name holds {asked.only!r}")
    if asked.case is not None:
        jobs = [(name, asked.seed, asked.case) for name in names]
    else:
        jobs = [(names[i % len(names)], asked.seed, i // len(names)) for i in range(asked.cases)]
    print(f"{len(jobs)} hard cases of {len(names)} families, seed {asked.seed}", flush=True)
    began = time.perf_counter()
    verdicts: Counter[tuple[str, str]] = Counter()
    slowest: dict[str, tuple[float, int]] = {}
    failures: list[Judged] = []
    for one in judged(iter(jobs), asked.workers, asked.limit):
        (name, _, number), verdict, detail, drawn, seconds = one
        verdicts[name, verdict] += 1
        slowest[name] = max(slowest.get(name, (0.0, 0)), (seconds, number))
        if verdict == "failed":
            failures.append(one)
        if asked.case is not None:
            print(f"{name} {number}: {verdict} {detail}\n  {drawn}")
    wide = max(map(len, names))
    for name in names:
        counts = "  ".join(f"{verdict} {verdicts[name, verdict]:4d}" for verdict in ("passed", "refused", "failed"))
        seconds, number = slowest.get(name, (0.0, 0))
        print(f"{name:{wide}}  {counts}  slowest {seconds:6.2f} s (case {number})")
    seconds, number, name = max((*found, name) for name, found in slowest.items())
    total: Counter[str] = Counter()
    for (_, verdict), count in verdicts.items():
        total[verdict] += count
    print(
        f"{len(jobs)} random hard cases, seed {asked.seed}: {total['passed']} passed, {total['refused']} refused with "
        f"an explanation, {total['failed']} failed; {time.perf_counter() - began:.0f} s"
    )
    print(f"slowest: {seconds:.2f} s, {name}, case {number}")
    for (name, seed, number), _, detail, drawn, _ in failures:
        print(f"failed: {name}, case {number}: {detail}")
        print(f"  drawn: {drawn}")
        print(f'  repeat: python -m tests.hard.many --seed {seed} --only "{name}" --case {number}')
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

"""Random hard cases of contact, memory, channels and evaluation, each held against a written right answer.

Cases run in worker processes, each under a time limit: one that does not come back is stopped and has failed. A case
passes, is refused with an explanation, or fails; a failure is printed with the command that repeats it. Exit status 1
if any failed.

Usage: python -m tests.hard.many [N] [--seed S] [--workers W] [--limit SECONDS] [--only TEXT] [--case NUMBER]

With --only, families whose name holds TEXT; with --case as well, that one case of each.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter, defaultdict

from tactbench.core.pool import Limits, Pool, preload
from tests.hard.cases import judged
from tests.hard.families import families


def main(arguments=None):
    """Run and print."""
    # One thread a worker: the cases are small, and linear algebra on all cores would only wait for itself.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="?", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--limit", type=float, default=120.0)
    parser.add_argument("--only", default="")
    parser.add_argument("--case", type=int)
    asked = parser.parse_args(arguments)
    names = [name for name in families() if asked.only in name]
    if not names:
        parser.error(f"no family's name holds {asked.only!r}")
    if asked.case is not None:
        jobs = [(name, asked.seed, asked.case) for name in names]
    else:
        jobs = [(names[i % len(names)], asked.seed, i // len(names)) for i in range(asked.cases)]
    print(f"{len(jobs)} hard cases of {len(names)} families, seed {asked.seed}", flush=True)
    began = time.perf_counter()
    verdicts: dict[str, Counter[str]] = defaultdict(Counter)
    slowest: dict[str, float] = defaultdict(float)
    failures = []
    preload("tests.hard.families")
    with Pool(asked.workers, Limits(timeout_s=asked.limit)) as pool:
        for place in range(asked.workers):
            pool.submit(judged, jobs[place :: asked.workers])
        for (name, _, number), outcome in pool.outcomes():
            if isinstance(outcome, BaseException):  # it hangs, or its process has died
                outcome = ("failed", f"{type(outcome).__name__}: {outcome}", {}, asked.limit)
            verdict, detail, drawn, seconds = outcome
            verdicts[name][verdict] += 1
            slowest[name] = max(slowest[name], seconds)
            if verdict == "failed":
                failures.append((name, number, detail, drawn))
            if asked.case is not None:
                print(f"{name} {number}: {verdict} {detail}\n  {drawn}")
    wide = max(map(len, names))
    for name in names:
        counts = "  ".join(f"{verdict} {verdicts[name][verdict]:4d}" for verdict in ("passed", "refused", "failed"))
        print(f"{name:{wide}}  {counts}  slowest {slowest[name]:6.2f} s")
    total = sum(verdicts.values(), Counter())
    print(
        f"{len(jobs)} random hard cases, seed {asked.seed}: {total['passed']} passed, {total['refused']} refused with "
        f"an explanation, {total['failed']} failed; {time.perf_counter() - began:.0f} s"
    )
    for name, number, detail, drawn in failures:
        print(f"failed: {name}, case {number}: {detail}")
        print(f"  drawn: {drawn}")
        print(f'  repeat: python -m tests.hard.many --seed {asked.seed} --only "{name}" --case {number}')
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

"""What the whole paper costs: `tactbench run` and `tactbench report`, cold, against the estimators' pure fit time.

Each round starts in an empty folder. The limit is 1.5 times the pure fit time of that round's estimators (the sum of
`fit_s` over all cells) plus 60 s for everything else: simulation, choice of parameters, intervals, embeddings, figures,
page. Then the page is made again from the stored results, which may take 10 s.

Usage: python benchmarks/report_time.py [ROUNDS]
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TACTBENCH = str(Path(sys.executable).with_name("tactbench"))
COLD_FACTOR, COLD_MORE_S, AGAIN_S = 1.5, 60.0, 10.0


def timed(*arguments: str, folder: Path) -> tuple[float, str]:
    """Return wall seconds of a whole process and its standard output."""
    began = time.perf_counter()
    done = subprocess.run([TACTBENCH, *arguments], cwd=folder, capture_output=True, text=True, check=True)
    return time.perf_counter() - began, done.stdout


def main() -> None:
    """Run the rounds and print the table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    run, report, again, fits = [], [], [], []
    for number in range(rounds):
        with tempfile.TemporaryDirectory() as name:
            seconds, text = timed("run", "--format", "json", folder=Path(name))
            run.append(seconds)
            fits.append(sum(row["fit_s"] or 0.0 for row in json.loads(text)))
            report.append(timed("report", folder=Path(name))[0])
            again.append(timed("report", folder=Path(name))[0])
        limit = COLD_FACTOR * fits[-1] + COLD_MORE_S
        print(f"round {number + 1}: run {run[-1]:.1f} s + report {report[-1]:.1f} s against {limit:.1f} s "
              f"(fits {fits[-1]:.1f} s); again {again[-1]:.1f} s", flush=True)  # fmt: skip
    shares = [(a + b) / (COLD_FACTOR * fit + COLD_MORE_S) for a, b, fit in zip(run, report, fits, strict=True)]
    print(f"cores {os.cpu_count()}, rounds {rounds}; median [min, max]")
    for label, values in (("run, s", run), ("report, s", report), ("report again, s", again), ("fits, s", fits),
                          ("cold / limit", shares)):  # fmt: skip
        print(f"{label:<16} {statistics.median(values):7.2f} [{min(values):.2f}, {max(values):.2f}]")
    print(f"cold within its limit: {max(shares) <= 1}; again within {AGAIN_S:g} s: {max(again) <= AGAIN_S}")


if __name__ == "__main__":
    main()

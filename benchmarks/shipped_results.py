"""Makes the results that come with tactbench, which `tactbench choose` reads where there are no others.

The default matrix under `deployable` and `karl2016`, by the command line, into a new folder; of its rows the keys that
`choose` needs go to `examples/results/default.json`, one row a line.

    python benchmarks/shipped_results.py [--out FOLDER] [--repeats N]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import tactbench

ROOT = Path(__file__).parents[1]
FILE = ROOT / "examples" / "results" / "default.json"
PROTOCOLS = ("deployable", "karl2016")
KEYS = (
    "cell", "sensor", "task", "rig", "simulated", "protocol", "dagger", "split", "estimator", "params", "is_baseline",
    "looks_at", "repeats", "seed", "n_replicates", "replicate_unit", "status", "metric", "unit", "score",
    "score_min", "score_max", "ci_low", "ci_high", "ci_method", "reference_floor", "score_beyond_floor",
    "beyond_floor_ci_low", "beyond_floor_ci_high", "n_recordings", "n_sessions", "answer_delay_ms", "delay_parts_ms",
    "latency_ms_p50",
)  # fmt: skip
"""What is kept of a row, where it has it."""


def main() -> None:
    """Run the matrix and write the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="result folder; default: a temporary one")
    parser.add_argument("--repeats", type=int, help="replicates; default: what `run` takes")
    given = parser.parse_args()
    command = ["run", "--config", "benchmarks.yaml", *(word for name in PROTOCOLS for word in ("--protocol", name))]
    if given.repeats is not None:
        command += ["--repeats", str(given.repeats)]
    with tempfile.TemporaryDirectory() as temporary:
        folder = str((given.out or Path(temporary) / "results").resolve())
        run = [sys.executable, "-m", "tactbench", *command, "--out", folder, "--format", "json"]
        done = subprocess.run(run, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    rows = json.loads(done.stdout)
    kept = [{key: rounded(row[key]) for key in KEYS if key in row} for row in rows]
    counts = sorted({row.get("n_replicates") or row["repeats"] for row in rows})
    words = " or ".join(f"{count} replicate{'s' if count > 1 else ''}" for count in counts)
    made = {"version": tactbench.__version__, "command": f"`tactbench {' '.join(command)}`",
            "seed": min(row["seed"] for row in rows), "replicates": words}  # fmt: skip
    lines = ",\n".join(json.dumps(row, ensure_ascii=False, sort_keys=True) for row in kept)
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(json.dumps(made, ensure_ascii=False)[:-1] + f', "rows": [\n{lines}\n]}}\n', encoding="utf-8")
    print(f"{FILE.relative_to(ROOT)}: {len(kept)} rows, {FILE.stat().st_size} bytes")


def rounded(value: object) -> object:
    """Return a number rounded to six significant digits: more would only be noise to whoever chooses."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()

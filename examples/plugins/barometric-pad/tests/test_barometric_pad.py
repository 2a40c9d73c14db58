"""CSV files become recordings, and recordings a score: from numbers that are made up here."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tactbench.testing import plugin_checks

MAPPING = Path(__file__).parents[1] / "mapping.yaml"
NAMES = [f"p{number}" for number in range(1, 9)]


@pytest.mark.parametrize("check", plugin_checks("barometric-pad"), ids=str)
def test_conforms(check):
    check()


def tactbench(folder, *arguments):
    command = [sys.executable, "-m", "tactbench", *arguments]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True, timeout=100).stdout


def test_from_tables_to_a_score(tmp_path):
    rng = np.random.default_rng(1)
    gains = rng.uniform(2.0, 6.0, 8)  # hPa/N: made up
    (tmp_path / "presses").mkdir()
    t_s = np.arange(500) / 50.0
    for day in ("monday", "tuesday", "wednesday"):
        force_n = np.interp(t_s, (0.0, 2.0, 10.0), (0.0, 0.0, 5.0)) * rng.uniform(0.7, 1.3)
        pressures = 1013.0 + force_n[:, None] * gains + rng.normal(0.0, 0.1, (500, 8))
        rows = np.column_stack([t_s, force_n + rng.normal(0.0, 0.01, 500), pressures])
        np.savetxt(tmp_path / "presses" / f"{day}-1.csv", rows, "%.6f", ",", header=",".join(["time_s", "force_n", *NAMES]),
                   comments="")  # fmt: skip
    said = tactbench(tmp_path, "import", str(MAPPING), "--root", ".", "--out", "pad")
    facts = dict(line.split(maxsplit=1) for line in said.splitlines())
    assert (facts["recordings"], facts["sensors"], facts["rows"]) == ("3", "barometric-pad", "1500")
    answer = ("--rig", "replay", "--recordings", "pad", "--task", "force", "--protocol", "deployable")
    rows = json.loads(tactbench(tmp_path, "run", *answer, "--estimator", "ols", "--format", "json"))
    scores = {row["estimator"]: row["score"] for row in rows}
    # Of one barometer, 0.1 hPa of noise at 2 to 6 hPa/N is 0.02 to 0.05 N; eight are better.
    assert scores["ols"] < 0.05
    assert scores["mean"] > 0.5

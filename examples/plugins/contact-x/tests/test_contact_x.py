"""The task, asked of the ideal taxel grid on the twin, and the conformance kit."""

import json
import subprocess
import sys

import pytest
from tactbench.testing import plugin_checks


@pytest.mark.parametrize("check", plugin_checks("contact-x"), ids=str)
def test_conforms(check):
    check()


def test_a_grid_of_taxels_knows_the_place(tmp_path):
    command = [sys.executable, "-m", "tactbench", "run", "--sensor", "ideal", "--task", "contact-x", "--estimator", "ridge",
               "--repeats", "1", "--format", "json"]  # fmt: skip
    done = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True, timeout=100)
    scores = {row["estimator"]: row["score"] for row in json.loads(done.stdout)}
    # An answer linear in readings that grow with the force too: it halves the error of knowing nothing, and no more is said.
    assert scores["ridge"] < scores["mean"] / 2
    assert scores["mean"] == pytest.approx(4.5**0.5, rel=0.01)  # the deviation of the five places

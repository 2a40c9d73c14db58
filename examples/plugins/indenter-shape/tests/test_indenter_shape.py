"""The shape and the task: the conformance kit, and that a grid of taxels tells shapes apart."""

import json
import subprocess
import sys

import pytest
from tactbench.testing import plugin_checks


@pytest.mark.parametrize("check", [*plugin_checks("cone"), *plugin_checks("indenter-shape")], ids=str)
def test_conforms(check):
    check()


def test_a_grid_of_taxels_tells_shapes_apart(tmp_path):
    command = [sys.executable, "-m", "tactbench", "run", "--sensor", "ideal", "--task", "indenter-shape", "--repeats", "1", "--format", "json"]  # fmt: skip
    done = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True, timeout=200)
    scores = {row["estimator"]: row["score"] for row in json.loads(done.stdout)}
    # Of places and angles that it was not trained on; one answer of five is right by chance.
    assert scores["forest-100"] > 2 * scores["chance"]

"""The effect in a recording of the ideal taxel grid, and the conformance kit."""

import subprocess
import sys

import h5py
import pytest
from tactbench.testing import plugin_checks


@pytest.mark.parametrize("check", plugin_checks("dead-taxels"), ids=str)
def test_conforms(check):
    check()


def stuck(folder, name, seed, *more):
    """Return which taxels do not move in a press."""
    command = [
        sys.executable,
        "-m",
        "tactbench",
        "record",
        "--sensor",
        "ideal",
        "--seed",
        str(seed),
        "--out",
        name,
        *more,
    ]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, timeout=100)
    with h5py.File(folder / name) as file:
        return (file["streams/taxels/data"][:].std(axis=0) == 0).tolist()


def test_dead_taxels_do_not_move(tmp_path):
    assert not any(stuck(tmp_path, "well.h5", 2))
    once = stuck(tmp_path, "dead.h5", 2, "--effects", "+dead-taxels")
    assert sum(once) == 2  # of 16, at a probability of 0.1 each, drawn by seed 2
    assert stuck(tmp_path, "other.h5", 1, "--effects", "+dead-taxels") != once

"""Cells group by group: which are at hand, and what is read only when its first cell is taken."""

from operator import length_hint

import pytest

from tactbench.core.matrix.engines.choice import EngineChoice
from tactbench.core.matrix.plan import plan_cells
from tactbench.core.matrix.preloading import Shared
from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.matrix import MatrixSpec, TaskChoice
from tests.core.cost.test_ladder import presses


@pytest.fixture
def jobs(tmp_path):
    """Three cells that need the recordings that are there, two that need one that is not, and one by itself."""
    presses(tmp_path / "shelf")
    there = tuple(sorted((tmp_path / "shelf").rglob("*.h5")))
    task = TaskChoice(name="force", protocol="deployable", split="session", estimators=("ols", "mean", "ridge"))
    cells = plan_cells(MatrixSpec(rig="replay", tasks=(task,)), ["made"], load_registry())[:3]
    missing = (tmp_path / "nowhere.h5",)
    return {
        ("force", there): [(cell, there, None) for cell in cells],
        ("force", missing): [(cell, missing, None) for cell in cells[:2]],
        ("force", there[:1]): [(cells[2], there[:1], None)],
    }


def test_the_cells_that_are_left_of_a_group_are_at_hand_and_the_first_of_the_next_if_nothing_is_to_be_read(jobs):
    shared = Shared(jobs, EngineChoice("isolated"))
    at_hand = [(length_hint(shared), job) for job in shared]
    assert [left for left, _ in at_hand] == [2, 1, 0, 1, 1, 0]
    assert length_hint(shared) == 0
    assert next(shared, None) is None
    found = [job for _, job in at_hand]
    assert [job[:2] for job in found] == [job[:2] for group in jobs.values() for job in group]
    assert [job[2] is None for job in found] == [True, True, True, False, False, True], "what cannot be read says why"

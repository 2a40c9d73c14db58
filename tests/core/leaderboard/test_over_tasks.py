"""Means over tasks: of what, and of what not."""

import numpy as np
import pytest

from tactbench.core.leaderboard.formats import plain_text
from tactbench.core.leaderboard.sections import over_tasks
from tactbench.core.leaderboard.table import build_table
from tactbench.core.statistics.aggregate import aggregate
from tests.core.leaderboard.rendering import to_latex, to_markdown

from .rows import resampled, row


@pytest.fixture
def rows():
    rng = np.random.default_rng(3)
    return [
        resampled(sensor, shift, rng, baseline=3.0, reference_score=0.5) | {"task": task, "cell": f"{sensor} {task}"}
        for sensor, shift in (("a", 0.0), ("b", 0.5))
        for task in ("force", "shear")
    ]


def test_each_answer_to_several_tasks_has_its_mean(rows):
    section = over_tasks(rows)
    assert [line[0] for line in section.lines] == ["a SIM", "b SIM"]
    for line, members in zip(section.lines, (rows[:2], rows[2:]), strict=True):
        mean = aggregate(members)
        assert line[3:] == (f"{mean.value:.3f}", f"{mean.low:.3f} … {mean.high:.3f}", "force, shear")
    table = build_table(rows)
    for text in (to_markdown(rows), to_latex(rows), plain_text(table)):
        assert "interquartile mean" in text


def test_what_does_not_stand_for_a_task_is_not_in_it(rows):
    assert over_tasks(rows[::2]) is None
    assert over_tasks([row(task="force"), row(task="shear")]) is None
    for change in ({"is_baseline": True}, {"split": "shuffled"}, {"protocol": "first-frame"}, {"status": "failed"}):
        assert over_tasks([rows[0] | change, rows[1]]) is None
    assert over_tasks([rows[0], rows[0] | {"split": "unit", "cell": "other"}, rows[1]]) is None
    assert over_tasks([rows[0] | {"baseline": None}, rows[1]]) is None

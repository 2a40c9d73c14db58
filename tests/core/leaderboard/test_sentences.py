"""What is said above and below a table is true of its rows."""

import json

from tactbench.core.leaderboard.formats import plain_text
from tactbench.core.leaderboard.table import build_table
from tests.core.leaderboard.rendering import to_json

from .rows import row

RECORDED = {"simulated": False, "rig": "replay"}


def answers(sensor, score, time_index, **more):
    """An answer from readings, beside what the time alone gives on the same sensor and a mean that is worse than both."""
    return [
        row(sensor, "forest", score, baseline=1.9, **more),
        row(sensor, "time-index", time_index, is_baseline=True, looks_at="time", **more),
        row(sensor, "mean", 1.9, is_baseline=True, looks_at="nothing", **more),
    ]


def ranks(rows):
    return {one["cell"].split("/")[0]: one["rank"] for one in json.loads(to_json(rows)) if not one["is_baseline"]}


def test_the_time_index_of_another_device_says_nothing_of_this_one():
    rows = [*answers("alike", 0.6, 0.17, **RECORDED), *answers("shuffled", 0.5, 1.85, **RECORDED)]
    assert "these scores need no touch" not in " ".join(plain_text(build_table(rows), 140).split())
    assert ranks(rows) == {"alike": None, "shuffled": 1}


def test_one_session_is_not_said_of_five():
    few = {**RECORDED, "n_replicates": 1, "replicate_unit": "session", "n_sessions": 5, "ci_low": None, "ci_high": None}
    text = plain_text(build_table([row("a", **few), row("b", score=0.6, **few)]), 140)
    assert "one session" not in text
    assert "1 session" not in text


def test_what_is_no_better_than_the_time_index_of_its_own_sensor_has_no_place():
    rows = [*answers("a", 0.5, 0.17), *answers("b", 0.6, 1.85)]
    assert ranks(rows) == {"a": None, "b": 1}

"""Published numbers beside ours."""

import pytest

from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.results import published_table, reproduce
from tests.core.leaderboard.rows import row

REGISTRY = load_registry()


def force_row(sensor="icub", estimator="lasso", score=0.68, **more):
    """A row of the force task as the paper asks it; the interval is the score ± 0.1."""
    named = f"{sensor}/force/{estimator}/1"
    asked = {"task": "force", "protocol": "karl2016", "split": "roles", "cell": named}
    return row(sensor, estimator, score) | asked | more


def beside(*rows):
    return reproduce(REGISTRY, rows)


@pytest.mark.parametrize(
    ("more", "verdict"),
    [
        ({"ci_low": 0.7659, "ci_high": 0.78}, "inside"),
        ({"ci_low": 0.58, "ci_high": 0.7658}, "outside"),
        ({"ci_low": None, "ci_high": None}, "no interval"),
        ({"status": "failed", "score": None, "reason": "unplugged"}, "no answer"),
    ],
)
def test_the_published_lies_inside_our_interval_bounds_included_or_there_is_a_reason(more, verdict):
    rows = [force_row(**more)]
    (line,) = beside(*rows)
    assert line.verdict == verdict
    table = published_table(REGISTRY, rows)
    shown = next(line for line in table.lines if line[1] == "0.7659")
    assert ("−0.0859" in shown) == (verdict != "no answer")
    assert shown[-1] == ("failed: unplugged" if verdict == "no answer" else verdict)


def test_rows_stand_beside_the_numbers_they_are_comparable_with_and_no_others():
    mine = force_row()
    others = [
        force_row(cell="a", protocol="deployable"),
        force_row(cell="b", estimator="ridge"),
        force_row(cell="c", params={"lambda_": 0.3}),
        force_row(cell="d", task="curvature"),
    ]
    assert [(line.published.score, line.row["cell"]) for line in beside(mine, *others)] == [(0.7659, mine["cell"])]
    rows = [force_row(sensor, "time-index", is_baseline=True) for sensor in ("biotac", "icub")]
    assert [(line.published.score, line.title.rpartition(" ")[2]) for line in beside(*rows)] == [
        (0.6875, "(biotac)"), (0.6875, "(icub)"),
    ]  # fmt: skip


def test_estimators_beside_one_published_number_are_told_apart():
    asked = {"protocol": "deployable", "split": "in-session"}
    rows = [force_row("eflesh", name, 0.3, **asked) for name in ("boosting", "forest-100")]
    assert [line.title.rpartition(" ")[2] for line in beside(*rows)] == ["(boosting)", "(forest-100)"]

from tactbench.core.plugins.registry import load_registry
from tactbench.core.report.findings import contrasts
from tests.core.leaderboard.rows import row


def told(*rows):
    return [(one.linear["estimator"], one.other["estimator"], one.sentence) for one in contrasts(rows, load_registry())]


def test_the_best_of_each_kind_is_compared_and_the_better_one_named():
    rows = [row("a", "lasso", 0.9), row("a", "ridge", 0.7), row("a", "forest", 0.3)]
    assert told(*rows) == [("ridge", "forest", "non-linear is better by 0.4000 N; the intervals are apart")]
    close = [row("a", "lasso", 0.70), row("a", "forest", 0.75)]
    assert told(*close) == [("lasso", "forest", "linear is better by 0.0500 N; the intervals overlap")]


def test_where_higher_is_better_the_higher_one_is():
    rows = [row("a", name, score, metric="macro_f1", unit="1") for name, score in (("logistic", 0.5), ("forest", 0.8))]
    assert told(*rows) == [("logistic", "forest", "non-linear is better by 0.300; the intervals are apart")]


def test_baselines_failures_strangers_and_other_questions_are_not_compared():
    linear = row("a", "lasso")
    others = [
        row("a", "mean", is_baseline=True),
        row("a", "forest", status="failed", score=None),
        row("a", "nobody-knows-it"),
        row("b", "forest"),
        row("a", "forest", split="shuffled"),
    ]
    assert told(linear, *others) == []

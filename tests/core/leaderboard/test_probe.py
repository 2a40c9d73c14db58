"""Verdicts of the probe, each seen to go both ways."""

import numpy as np
import pytest

from tactbench.core.leaderboard.probe import build_probe
from tests.core.leaderboard.rendering import to_markdown
from tests.core.leaderboard.rows import row


def classed(score, protocol="deployable", split="recording", **more):
    """A row of a task with four classes, by accuracy; the trivial answer has 0.25."""
    n, right = 40, round(40 * score)
    confusion = np.zeros((4, 4), dtype=int)
    for place in range(n):
        confusion[place % 4, place % 4 if place < right else (place + 1) % 4] += 1
    return row(
        score=score, metric="accuracy", unit="1", baseline=0.25, protocol=protocol, split=split, n_test=n,
        confusion=confusion.tolist(), ci_low=score - 0.03, ci_high=score + 0.03, **more,
    )  # fmt: skip


def erring(score, protocol="deployable", split="session", **more):
    """A row of a regression in newtons; the trivial answer errs by 10 N."""
    more = {"ci_low": score - 0.2, "ci_high": score + 0.2, "n_test": 20} | more
    return row(score=score, metric="rmse", unit="N", baseline=10.0, protocol=protocol, split=split, **more)


def verdict(*rows):
    table = build_probe(rows)
    (line,) = table.lines
    return dict(zip(table.columns, line, strict=True))["verdict"]


@pytest.mark.parametrize(
    ("first", "says"),
    [
        (0.90, "LEAK: the first frame alone scores 0.900 of 0.950"),
        # Half of the skill of 0.7 over the trivial 0.25, on either side.
        (0.625, "LEAK: the first frame alone scores 0.625 of 0.950"),
        (0.575, "the first frame alone scores 0.575 of 0.950: a part of the answer is known before"),
        # Of 40 guesses of four, 16 or more are right in 2.6 % of the cases, 17 or more in 1.2 %: the line is 2.5 %.
        (0.425, "the first frame alone scores 0.425 of 0.950: a part of the answer is known before"),
        (0.40, "no leak shown"),
        (0.25, "no leak shown"),
    ],
)
def test_the_first_frame_of_classes(first, says):
    assert verdict(classed(0.95), classed(first, "first-frame")) == says


@pytest.mark.parametrize(
    ("first", "more", "says"),
    [
        (2.0, {}, "LEAK: the first frame alone scores 2.0000 of 1.0000 N"),
        (5.6, {}, "the first frame alone scores 5.6000 of 1.0000 N: a part of the answer is known before"),
        (9.9, {"ci_low": 9.0, "ci_high": 10.5}, "no leak shown"),
        (12.0, {}, "no leak shown"),
        (2.0, {"n_test": 4}, "too few recordings or replicates to say what the first frame tells"),
        (2.0, {"ci_low": None, "ci_high": None}, "too few recordings or replicates to say what the first frame tells"),
    ],
)
def test_the_first_frame_of_numbers(first, more, says):
    assert verdict(erring(1.0), erring(first, "first-frame", **more)) == says


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        (
            [classed(0.88), classed(0.86, "first-frame"), classed(0.99, split="shuffled")],
            "LEAK: the first frame alone scores 0.860 of 0.880; optimistic by 0.110 when shuffled",
        ),
        ([classed(0.88), classed(0.94, split="shuffled")], "optimistic by 0.060 when shuffled"),
        ([classed(0.88), classed(0.90, split="shuffled")], "no leak shown"),
        ([classed(0.88), classed(0.70, split="shuffled")], "no leak shown"),
        ([erring(1.0), erring(0.5, split="shuffled")], "optimistic by 0.5000 N when shuffled"),
        (
            [erring(1.0, split="roles"), erring(0.5, split="shuffled", n_test=99)],
            "optimistic by 0.5000 N when shuffled (tested on other rows)",
        ),
        ([erring(1.0), erring(0.9, split="shuffled")], "no leak shown"),
        ([erring(1.0), erring(1.5, split="shuffled")], "no leak shown"),
    ],
)
def test_shuffled_rows_against_the_interval(rows, says):
    assert verdict(*rows) == says


def test_each_split_has_the_first_frame_of_its_own():
    table = build_probe([
        classed(0.95), classed(0.93, split="trial"), classed(0.30, "first-frame"),
        classed(0.90, "first-frame", split="trial"), classed(0.95, split="shuffled"),
    ])  # fmt: skip
    verdicts = {line[table.columns.index("split")]: line[-1] for line in table.lines}
    assert verdicts["recording"] == "no leak shown"
    assert verdicts["trial"].startswith("LEAK")


def test_other_sensors_estimators_are_no_partners():
    for other in ({"sensor": "b"}, {"estimator": "ridge"}, {"params": {"n_estimators": 5}}):
        assert build_probe([classed(0.95), classed(0.90, "first-frame") | other]) is None


def test_nothing_is_shown_where_nothing_was_probed():
    assert build_probe([classed(0.9), classed(0.2, is_baseline=True)]) is None
    assert build_probe([erring(1.0, split="in-session"), erring(0.5, split="shuffled")]) is None
    assert "Probe" not in to_markdown([classed(0.9)])


def test_a_probe_that_makes_no_sense_says_why():
    skipped = classed(0.0, "first-frame", split=None, status="skipped", reason="Each is one reading.") | {"score": None}
    table = build_probe([classed(0.9), skipped])
    assert table.lines[0][table.columns.index("first frame alone")] == "skipped"
    assert table.notes[-1] == "a/question: Each is one reading."


@pytest.mark.parametrize(
    ("scores", "says"),
    [
        ({"mean": 10.0, "time-index": 0.9}, "TRIVIAL: time-index scores 0.9000 of 1.0000 N"),
        ({"time-index": 1.1, "mean": 10.0}, "not shown to be better than time-index: 1.1000 of 1.0000 N"),
        ({"mean": 0.5, "time-index": 0.9}, "TRIVIAL: mean scores 0.5000 of 1.0000 N"),
        ({"mean": 10.0, "time-index": 3.0}, "no leak shown"),
    ],
)
def test_the_best_of_all_trivial_answers_is_looked_at(scores, says):
    trivial = [
        erring(value, estimator=name, is_baseline=True, looks_at="time" if name == "time-index" else "nothing")
        for name, value in scores.items()
    ]
    elsewhere = erring(0.1, estimator="mean", is_baseline=True, split="press")
    table = build_probe([erring(1.0), erring(1.2, split="shuffled"), *trivial, elsewhere])
    (line,) = table.lines
    assert line[-1] == says
    assert table.kinds == ("alarm" if says.startswith("TRIVIAL") else "plain",)
    best = min(scores, key=scores.get)
    assert line[table.columns.index("trivial")] == f"{scores[best]:.4f} {best}"


def test_without_an_interval_nothing_holds_the_shuffled_score():
    """One session carries no interval: tables take its ends from the row."""
    alone = classed(0.95) | {"ci_low": None, "ci_high": None}
    assert verdict(alone, classed(0.99, split="shuffled")) == "no interval to hold the shuffled score against"

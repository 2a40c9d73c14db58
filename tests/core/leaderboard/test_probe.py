"""Verdicts of the probe, each seen to go both ways."""

import numpy as np
import pytest

from tactbench.core.leaderboard.probe import build_probe, with_leaks
from tests.core.leaderboard.rows import row


def classed(score, protocol="deployable", split="recording", **more):
    """A row of a task with four classes, by accuracy; the trivial answer has 0.25."""
    n, right = 40, round(40 * score)
    confusion = np.zeros((4, 4), dtype=int)
    for place in range(n):
        confusion[place % 4, place % 4 if place < right else (place + 1) % 4] += 1
    return row(
        score=score, metric="accuracy", unit="1", baseline=0.25, protocol=protocol, split=split, n_test=n,
        confusion=confusion.tolist(), **({"ci_low": score - 0.03, "ci_high": score + 0.03} | more),
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
    ("rows", "says"),
    [
        # Half of the skill of 0.7 over the trivial 0.25, on either side.
        ([classed(0.95), classed(0.625, "first-frame")], "LEAK"),
        ([classed(0.95), classed(0.575, "first-frame")], "PART"),
        # Of 40 guesses of four, 16 or more are right in 2.6 % of the cases, 17 or more in 1.2 %: the line is 2.5 %.
        ([classed(0.95), classed(0.425, "first-frame")], "PART"),
        ([classed(0.95), classed(0.40, "first-frame")], "no leak shown"),
        ([erring(1.0), erring(9.9, "first-frame", ci_low=9.0, ci_high=10.5, n_test=5)], "no leak shown"),
        ([erring(1.0), erring(2.0, "first-frame", n_test=4)], "too few recordings for the first frame"),
        ([classed(0.88), classed(0.86, "first-frame"), classed(0.99, split="shuffled")], "LEAK, OPTIMISTIC"),
        ([classed(0.88), classed(0.90, split="shuffled")], "no leak shown"),
        ([classed(1.0, stamps=["leaks: a"]), classed(0.1, "first-frame")], "LEAK"),
        ([classed(1.0, stamps=["1 of 5 recordings left out"]), classed(0.1, "first-frame")], "no leak shown"),
        ([erring(1.0), erring(0.5, split="shuffled")], "OPTIMISTIC"),
        (
            [classed(0.95, ci_low=None, ci_high=None), classed(0.99, split="shuffled")],
            "no interval for shuffled rows",
        ),
    ],
)
def test_first_frames_and_shuffled_rows(rows, says):
    assert verdict(*rows) == says
    stamps = with_leaks(rows)[0]["stamps"]
    assert (len(stamps) > len(rows[0]["stamps"])) == (says.startswith("LEAK") and not rows[0]["stamps"])


def test_nothing_is_shown_where_nothing_was_probed():
    assert build_probe([classed(0.9), classed(0.2, is_baseline=True)]) is None
    assert build_probe([classed(0.95), classed(0.90, "first-frame", sensor="b")]) is None
    assert build_probe([erring(1.0, split="in-session"), erring(0.5, split="shuffled")]) is None


def test_a_probe_that_makes_no_sense_says_why():
    skipped = classed(0.0, "first-frame", split=None, status="skipped", reason="One.") | {"score": None}
    table = build_probe([classed(0.9), skipped])
    assert "skipped" in table.lines[0]
    assert table.notes[-1] == "a/question: One."

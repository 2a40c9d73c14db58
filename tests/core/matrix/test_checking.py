"""What comes back from a cell is looked at before it is kept."""

import numpy as np
import pytest

from tactbench.core.matrix.checking import fault_in
from tactbench.core.matrix.evaluate_cell import opening
from tactbench.core.matrix.plan import Cell
from tactbench.core.samples import Answers
from tests.core.evaluation.made import force_task

CELL = Cell("made", "force", "replay", "deployable", "session", "ols", (), False, 1, 1, 1)
OPENED = opening(CELL, force_task())


def answers(n=5):
    number = np.arange(n)
    column = np.linspace(0.0, 1.0, n)
    return vars(Answers(column, column, number, number, number, column, column))


def row(**changes):
    return {**OPENED, "status": "done", "score": 0.0, "ci_low": 0.0, "ci_high": 0.6, "n_test": 5, **changes}


def test_an_honest_result_has_no_fault():
    assert fault_in((row(), {"test": answers()}), OPENED) == ""
    assert fault_in((row(ci_low=None, ci_high=None), {"test": answers()}), OPENED) == ""


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (None, "a NoneType and not a row"),
        ((row(), {"test": answers()}, 3), "a tuple and not a row"),
        ((row(more=1), {"test": answers()}), "other keys: more"),
        ((row(cell="another"), {"test": answers()}), "another cell"),
        ((row(status="splendid"), {"test": answers()}), "'splendid'"),
        ((row(status="failed"), {}), "'failed'"),
        ((row(score=float("nan")), {"test": answers()}), "is nan"),
        ((row(score=0.25), {"test": answers()}), "its score is 0.25, and its answers give 0.0"),
        ((row(sensor="another"), {"test": answers()}), "its sensor is 'another', not 'made'"),
        ((row(score="high"), {"test": answers()}), "its score: Input should be a valid number"),
        ((row(score=None), {"test": answers()}), "score is None"),
        ((row(recordings="every"), {"test": answers()}), "its recordings: Input should be a valid list"),
        ((row(recordings=[b"one"]), {"test": answers()}), "its recordings.0: Input should be a valid string"),
        ((row(), {}), "no answers to the test set"),
        ((row(), {"test": [1, 2, 3]}), "are a list"),
        ((row(), {"test": {"y_true": np.arange(5)}}), "without the columns of answers"),
        ((row(n_test=6), {"test": answers()}), "gave 5 test answers and says 6"),
        ((row(), {"test": answers() | {"row": np.arange(4)}}), "differ in length"),
        ((row(), {"test": answers() | {"y_pred": np.full(5, np.nan)}}), "NaN or infinite"),
        ((row(), {"test": answers() | {"y_pred": np.zeros((5, 1))}}), "no plain column y_pred"),
        ((row(), {"test": answers() | {"y_pred": np.array([object()] * 5)}}), "no plain column y_pred"),
    ],
)
def test_a_lie_is_named(given, says):
    assert says in fault_in(given, OPENED)

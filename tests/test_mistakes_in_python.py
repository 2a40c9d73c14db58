"""Every argument of the functions in Python given wrongly once: the message names it, what was given, what it takes."""

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import GroupKFold, KFold

import tactbench
from tactbench.core.errors import TactbenchError
from tests.core.evaluation.made import sessions

N = 120
"""Rows of the recordings."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("presses")
    sessions(folder, "abc", n=40)
    return folder


def arrays(**more):
    given = {"X": np.arange(60.0).reshape(20, 3), "y": np.arange(20.0), **more}
    return tactbench.from_arrays(given.pop("X"), given.pop("y"), **given)


OF_TASKS = [
    ("task", "forse", "forse"),
    ("task", 3, "3"),
    ("recordings", "nowhere/*.h5", "nowhere"),
    ("recordings", 3, "3"),
    ("recordings", None, "None"),
    ("recordings", [], "[]"),
    ("recordings", [Ridge()], "Ridge()"),
    ("protocol", "deployed", "deployed"),
    ("protocol", "deployable@k=x", "k=x"),
    ("protocol", 3, "3"),
    ("split", "sesion", "sesion"),
    ("split", 5, "5"),
    ("split", [(np.arange(5), np.arange(500, 505))], "1 given folds"),
    ("split", [1, 2], "2 given folds"),
    ("split", [], "0 given folds"),
    ("split", [([0, 0], [1])], "1 given folds"),
    ("split", GroupKFold(50), "GroupKFold"),
    ("groups", "session", "session"),  # of a split by name
    ("window", 0, "0"),
    ("window", 2.5, "2.5"),
    ("window", "8", "'8'"),
    ("step", 2, "2"),  # of no window
    ("seed", -1, "-1"),
    ("seed", "one", "one"),
]


@pytest.mark.parametrize(("argument", "given", "shown"), OF_TASKS)
def test_of_tasks(folder, argument, given, shown):
    arguments = {"task": "force", "recordings": folder, argument: given}
    _named(lambda: tactbench.load_task(**arguments), argument, shown)


def test_of_a_protocol_that_the_task_does_not_allow(folder):
    _named(lambda: tactbench.load_task("shear-force", folder, "karl2016"), "protocol", "karl2016")


@pytest.mark.parametrize(
    ("argument", "given", "shown", "more"),
    [
        ("groups", "sesion", "sesion", {"split": KFold(3)}),
        ("groups", [1, 2], "[1, 2]", {"split": KFold(3)}),
        ("groups", np.full(N, np.nan), "nan", {"split": KFold(3)}),
        ("step", 0, "0", {"window": 4}),
        ("estimator", Ridge, "Ridge", {}),
        ("estimator", "ridgge", "ridgge", {}),
        ("estimator", None, "None", {}),
        ("estimator", "ridge", "ridge", {"window": 4}),
        ("metric", "rmsse", "rmsse", {}),
        ("metric", "accuracy", "accuracy", {}),
        ("metric", "roc_auc", "roc_auc", {}),
        ("metric", 3, "3", {}),
        ("greater_is_better", None, "None", {"metric": np.dot}),
        ("greater_is_better", "yes", "yes", {"metric": np.dot}),
        ("greater_is_better", True, "True", {"metric": "mae"}),
        ("greater_is_better", True, "True", {}),
        ("params", 3, "3", {}),
        ("params", {"sample_weight": [1.0]}, "[1.0]", {}),
        ("params", {"groups": "sesion"}, "sesion", {}),
        ("params", {"groups": np.zeros((N, 2))}, "(120, 2)", {}),
        ("params", {"weights": 3}, "weights", {}),
        ("params", {"sample_weight": np.ones(N)}, "sample_weight", {"estimator": "ridge"}),
    ],
)
def test_of_scores(folder, argument, given, shown, more):
    arguments = {"estimator": Ridge(), **more, argument: given}
    _named(lambda: tactbench.evaluate(task="force", recordings=folder, **arguments), argument, shown)


@pytest.mark.parametrize(
    ("argument", "given", "shown"),
    [
        ("X", np.arange(20.0), "0."),
        ("X", np.full((20, 3), "a"), "'a'"),
        ("X", [], "[]"),
        ("X", np.full((20, 3), np.inf), "inf"),
        ("y", np.arange(19.0), "19"),
        ("y", "force", "force"),
        ("y", np.zeros((20, 2, 2)), "0."),
        ("time_s", np.arange(3.0), "2."),
        ("time_s", ["a"] * 20, "'a'"),
        ("time_s", np.arange(20).astype("M8[s]"), "1970"),
        ("groups", [1, 2], "[1, 2]"),
        ("groups", np.full(20, np.nan), "nan"),
        ("sensor", "My board", "My board"),
        ("sensor", 3, "3"),
        ("task", "My task", "My task"),
        ("task", 3, "3"),
        ("task", "slip", "slip"),
        ("unit", "newton", "newton"),
        ("unit", 3, "3"),
        ("simulated", "twin", "twin"),
    ],
)
def test_of_arrays(argument, given, shown):
    _named(lambda: arrays(**{argument: given}), argument, shown)


def test_of_arrays_that_answer_an_installed_task():
    _named(lambda: arrays(task="force", y=np.full(20, "a")), "y", "'a'")
    _named(lambda: arrays(task="three-axis-force"), "y", "19.")
    _named(lambda: arrays(task="force", unit="mm"), "unit", "mm")


@pytest.mark.parametrize("given", [3, None, "nowhere.h5", ["nowhere.h5"]])
def test_of_recordings(given):
    shown = str(given) if given in (3, None) else "nowhere.h5"
    _named(lambda: tactbench.open_recordings(given), "path_or_paths", shown)


def test_of_data_sets(tmp_path):
    _named(lambda: tactbench.dataset("efles"), "name", "efles")
    _named(lambda: tactbench.dataset(3), "name", "3")
    _named(lambda: tactbench.dataset("eflesh-shear", root=3), "root", "3")
    _named(lambda: tactbench.dataset("eflesh-shear", root=tmp_path / "no"), "root", "no")


def _named(call, argument, shown):
    with pytest.raises(TactbenchError) as raised:
        call()
    assert argument.casefold() in str(raised.value).casefold()
    assert shown in str(raised.value)
    assert raised.value.hint

"""docs/estimators.md names every rung, and the numbers it states are the descriptors'."""

from pathlib import Path

import pytest

from tactbench.estimators import LAMBDAS, WINDOWS, tactbench_estimators

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "estimators.md").read_text(encoding="utf-8")
BY_NAME = {descriptor.name: descriptor for descriptor in tactbench_estimators()}


def line(name):
    return next(line for line in TEXT.splitlines() if line.startswith("|") and f"`{name}`" in line.split("|")[1])


@pytest.mark.parametrize("name", sorted(BY_NAME))
def test_every_rung_has_its_line_and_is_said_to_answer_what_it_answers(name):
    kinds = BY_NAME[name].kinds
    said = (
        "both" if len(kinds) == 2 else {"regression": "number", "classification": "class", "events": "event"}[kinds[0]]
    )
    assert line(name).split("|")[2].strip() == said


@pytest.mark.parametrize(
    ("name", "parameter", "written"),
    [
        ("logistic", "C", "`C={}`"),
        ("knn", "n_neighbors", "`n_neighbors={}`"),
        ("svm", "rows", "`rows={}`"),
        ("svm", "C", "`C={}`"),
        ("boosting", "max_iter", "{} rounds"),
        ("boosting", "max_leaf_nodes", "{} leaves"),
        ("mlp", "hidden", "`hidden={}`"),
        ("mlp", "max_iter", "`max_iter={}`"),
    ],
)
def test_stated_parameters_are_the_defaults(name, parameter, written):
    value = BY_NAME[name].params[parameter]
    assert written.format(f"{value:g}") in line(name)


def test_stated_grids_are_those_that_are_searched():
    assert f"`lambda_` of {LAMBDAS[0]} … {LAMBDAS[-1]}" in line("lasso")
    assert f"the window of {', '.join(map(str, WINDOWS))} samples" in line("ridge")
    assert f"`alpha` of {', '.join(f'{value:g}' for value in BY_NAME['ridge'].grid['alpha'])}" in line("ridge")
    assert "10, 50, 100, 500 trees" in line("forest")
    assert BY_NAME["forest"].params["n_estimators"] == 500

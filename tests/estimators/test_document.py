"""docs/estimators.md names every rung, and the numbers it states are the descriptors'."""

from pathlib import Path

from tactbench.estimators import LAMBDAS, WINDOWS, tactbench_estimators

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "estimators.md").read_text(encoding="utf-8")
BY_NAME = {descriptor.name: descriptor for descriptor in tactbench_estimators()}
SAID = {"regression": "number", "classification": "class", "events": "event"}


def line(name):
    return next(line for line in TEXT.splitlines() if line.startswith("|") and f"`{name}`" in line.split("|")[1])


def test_every_rung_has_its_line_and_is_said_to_answer_what_it_answers():
    for name, descriptor in BY_NAME.items():
        said = "both" if len(descriptor.kinds) == 2 else SAID[descriptor.kinds[0]]
        assert line(name).split("|")[2].strip() == said


def test_stated_parameters_are_the_defaults_and_stated_grids_those_that_are_searched():
    for name, parameter, written in (
        ("logistic", "C", "`C={:g}`"), ("knn", "n_neighbors", "`n_neighbors={}`"), ("svm", "rows", "`rows={}`"),
        ("svm", "C", "`C={:g}`"), ("boosting", "max_iter", "{} rounds"), ("boosting", "max_leaf_nodes", "{} leaves"),
        ("mlp", "hidden", "`hidden={}`"), ("mlp", "max_iter", "`max_iter={}`"), ("forest", "n_estimators", "{} trees"),
    ):  # fmt: skip
        assert written.format(BY_NAME[name].params[parameter]) in line(name)
    assert f"`lambda_` of {LAMBDAS[0]} … {LAMBDAS[-1]}" in line("lasso")
    assert f"the window of {', '.join(map(str, WINDOWS))} samples" in line("ridge")
    assert f"`alpha` of {', '.join(f'{value:g}' for value in BY_NAME['ridge'].grid['alpha'])}" in line("ridge")

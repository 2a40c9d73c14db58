"""Random hard recordings through every protocol and every installed estimator."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tactbench.core.errors import DataError
from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.evaluation.interval import block_length
from tactbench.core.evaluation.protocols import PROTOCOLS
from tactbench.plugin import load_registry
from tests.core.evaluation.made import force_task, label_task, record

from .families import evaluation
from .judging import never_fails

ESTIMATORS = load_registry().estimators
FAMILIES = evaluation.families()
ROLES = ("train", "validation", "test")
RANKED = [name for name, protocol in PROTOCOLS.items() if not protocol.probe]
"""Protocols that answer where a force changes within a recording."""


def test_every_protocol_meets_every_estimator_that_can_answer_here():
    met = {tuple(name.removeprefix("evaluation: ").split(" ")[::2]) for name in FAMILIES}
    assert {protocol for protocol, _ in met} == set(PROTOCOLS)
    trees = {"forest-10", "forest-50", "forest-100", "forest", "forest-fast-10", "forest-fast-50", "forest-fast-100",
             "forest-fast"}  # fmt: skip
    asked_of_samples = {one.name for one in ESTIMATORS if one.kinds != ("events",)}
    assert asked_of_samples - {name for _, name in met} <= trees


@pytest.mark.parametrize("name", FAMILIES)
def test_no_case_of_the_family_fails(name):
    never_fails(name, FAMILIES[name], 1)


def _score(task, estimator, protocol, paths, params=None):
    ticks = itertools.count()
    result = evaluate_cell(
        CellContext(
            task,
            ESTIMATORS[estimator],
            params or {},
            protocol,
            "roles",
            seed=1,
            clock=lambda: next(ticks) * 1e-3,
            latency=False,
        ),
        paths,
    )
    assert np.isfinite([result.score, result.interval.low, result.interval.high]).all()
    return result


def _pressed(folder, *, offset=0.0, change=None, **more):
    """One recording a role: a ramp, two taxels of unit noise."""
    paths = []
    for place, role in enumerate(ROLES):
        rng = np.random.default_rng(place)
        force = np.linspace(0, 5, 800)
        X = force[:, None] * [2.0, -1.0] + rng.normal(0, 1, (800, 2)) + offset
        if change is not None:
            change(role, X, force)
        paths.append(record(folder / f"{role}.h5", X, force, role=role, session=role, **more))
    return paths


@pytest.mark.parametrize("protocol", RANKED)
@pytest.mark.parametrize("estimator", ["lasso", "ridge"])
def test_an_offset_of_1e8_on_a_unit_signal_changes_nothing(tmp_path, protocol, estimator):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    plain = _score(force_task(), estimator, protocol, _pressed(tmp_path / "a"))
    far = _score(force_task(), estimator, protocol, _pressed(tmp_path / "b", offset=1e8))
    # A double at 1e8 resolves 1.5e-8 of the unit noise: that much at most reaches a z-score, and so a force of 5 N.
    assert far.score == pytest.approx(plain.score, rel=1e-6)
    assert far.chosen == plain.chosen


@pytest.mark.parametrize("protocol", RANKED)
def test_collinear_taxels_have_one_set_of_fitted_values(tmp_path, protocol):
    def doubled(_, X, __):
        X[:, 1] = 3 * X[:, 0] + 7

    def alone(_, X, __):
        X[:, 1] = 0.0

    scores = []
    for name, change in (("doubled", doubled), ("alone", alone)):
        (tmp_path / name).mkdir()
        scores.append(_score(force_task(), "lasso", protocol, _pressed(tmp_path / name, change=change)).score)
    # The Lasso's fitted values are unique whatever the copies; its duality gap is held to 1e-5 of |y|².
    assert scores[0] == pytest.approx(scores[1], rel=1e-3)


@pytest.mark.parametrize("protocol", RANKED)
def test_rows_with_a_dropout_are_left_out_and_counted(tmp_path, protocol):
    def dropped(role, X, _):
        X[700:710, 0] = np.nan
        X[720, 1] = np.inf

    result = _score(force_task(), "ridge", protocol, _pressed(tmp_path, change=dropped))
    assert result.counts["rows left out because t0 has no sample"] == 30
    assert result.counts["rows left out because t1 has no sample"] == 3


def test_a_rule_that_leaves_no_row_is_explained(tmp_path):
    rng = np.random.default_rng(0)
    paths = []
    for role in ROLES:
        X = np.ones((612, 12)) + rng.normal(0, 1e-6, (612, 12))
        X[600:][np.arange(12), np.arange(12)] = 1e3
        paths.append(record(tmp_path / f"{role}.h5", X, np.linspace(0, 5, 612), role=role, session=role))
    with pytest.raises(DataError, match="three-sigma") as refused:
        _score(force_task(), "mean", "karl2016", paths)
    assert "deployable" in refused.value.hint


@pytest.mark.parametrize("estimator", ["mean", "forest"])
def test_a_validation_set_without_labels_is_no_reason_to_refuse(tmp_path, estimator):
    def unlabelled(role, _, force):
        if role == "validation":
            force[:] = np.nan

    params = {"n_estimators": 5} if estimator == "forest" else {}
    result = _score(force_task(), estimator, "karl2016", _pressed(tmp_path, change=unlabelled), params)
    assert "validation" not in result.scores


def test_an_inner_set_without_rows_is_no_reason_against_the_others(tmp_path):
    paths = _pressed(tmp_path)
    for place in range(2):
        # Shorter than nothing the split needs, but gone once its hold-out has been cut off.
        paths.append(record(tmp_path / f"short{place}.h5", np.ones((2, 2)), np.ones(2), role="train", session="train"))
    _score(force_task(), "ridge", "deployable", paths)


@pytest.mark.parametrize("size", [1e-150, 1.0, 1e150])
def test_the_length_of_a_block_knows_no_unit(size):
    loss = np.convolve(np.random.default_rng(0).standard_normal(500), np.ones(10), "valid") ** 2
    assert block_length(size * loss) == block_length(loss) > 8
    assert block_length(np.zeros(100)) == 5


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_one_class_to_learn_is_explained(tmp_path, protocol):
    paths = [record(tmp_path / f"{role}.h5", np.random.default_rng(0).normal(0, 1, (700, 2)), role=role, session=role,
                    labels={"kind": "a"}) for role in ROLES]  # fmt: skip
    with pytest.raises(DataError, match="nothing to learn") as refused:
        _score(label_task(), "majority", protocol, paths)
    assert refused.value.hint

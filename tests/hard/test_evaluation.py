"""Hard recordings whose right answer is a number, or words."""

import numpy as np
import pytest

from tactbench.core.errors import DataError
from tactbench.core.evaluation.protocols import PROTOCOLS
from tactbench.core.evaluation.reference_floor import integrated_correlation
from tests.core.evaluation.made import evaluated, force_task, record

ROLES = ("train", "validation", "test")
RANKED = [name for name, protocol in PROTOCOLS.items() if not protocol.first_row_only]
"""Protocols that answer where a force changes within a recording."""


def scored(paths, estimator, protocol, task=None, **params):
    asked = (task or force_task()).model_copy(update={"protocols": tuple(PROTOCOLS)})
    result = evaluated(asked, paths, estimator, protocol, "roles", params=params)
    assert np.isfinite(result.score)
    assert result.ci_low is None
    return result


def pressed(folder, change=lambda role, X, force: None):
    """One recording a role: a ramp, two taxels of unit noise."""
    folder.mkdir(exist_ok=True)
    paths = []
    for place, role in enumerate(ROLES):
        force = np.linspace(0, 5, 800)
        X = force[:, None] * [2.0, -1.0] + np.random.default_rng(place).normal(0, 1, (800, 2))
        change(role, X, force)
        paths.append(record(folder / f"{role}.h5", X, force, role=role, session=role))
    return paths


@pytest.mark.parametrize("protocol", RANKED)
@pytest.mark.parametrize("estimator", ["lasso", "ridge"])
def test_an_offset_of_1e8_on_a_unit_signal_changes_nothing(tmp_path, protocol, estimator):
    def offset(_, X, __):
        X += 1e8

    plain = scored(pressed(tmp_path / "a"), estimator, protocol)
    far = scored(pressed(tmp_path / "b", offset), estimator, protocol)
    # A double at 1e8 resolves 1.5e-8 of the unit noise: that much at most reaches a z-score, and so a force of 5 N.
    assert far.score == pytest.approx(plain.score, rel=1e-6)
    assert far.chosen == plain.chosen


@pytest.mark.parametrize("protocol", RANKED)
def test_collinear_taxels_have_one_set_of_fitted_values(tmp_path, protocol):
    def doubled(_, X, __):
        X[:, 1] = 3 * X[:, 0] + 7

    def alone(_, X, __):
        X[:, 1] = 0.0

    scores = [
        scored(pressed(tmp_path / change.__name__, change), "lasso", protocol).score for change in (doubled, alone)
    ]
    # The Lasso's fitted values are unique whatever the copies; its duality gap is held to 1e-5 of |y|².
    assert scores[0] == pytest.approx(scores[1], rel=1e-3)


def test_a_rule_that_leaves_no_row_is_explained(tmp_path):
    rng = np.random.default_rng(0)
    paths = []
    for role in ROLES:
        X = np.ones((612, 12)) + rng.normal(0, 1e-6, (612, 12))
        X[600:][np.arange(12), np.arange(12)] = 1e3
        paths.append(record(tmp_path / f"{role}.h5", X, np.linspace(0, 5, 612), role=role, session=role))
    with pytest.raises(DataError, match="three-sigma") as refused:
        scored(paths, "mean", "karl2016")
    assert "deployable" in refused.value.hint


@pytest.mark.parametrize("estimator", ["mean", "ols"])
def test_a_validation_set_without_labels_is_no_reason_to_refuse(tmp_path, estimator):
    def unlabelled(role, _, force):
        force[:] = np.nan if role == "validation" else force

    assert "validation" not in scored(pressed(tmp_path, unlabelled), estimator, "karl2016").scores


def test_an_inner_set_without_rows_is_no_reason_against_the_others(tmp_path):
    paths = pressed(tmp_path)
    for place in range(2):
        # Shorter than nothing the split needs, but gone once its hold-out has been cut off.
        paths.append(record(tmp_path / f"short{place}.h5", np.ones((2, 2)), np.ones(2), role="train", session="train"))
    found = scored(paths, "ridge", "deployable")
    assert found.n_recordings == 5
    assert np.isfinite(found.score)


@pytest.mark.parametrize("size", [1e-150, 1.0, 1e150])
def test_the_correlation_of_a_reference_knows_no_unit(size):
    noise = np.convolve(np.random.default_rng(0).standard_normal(500), np.ones(10), "valid")
    noise -= noise.mean()
    assert integrated_correlation(size * noise) == pytest.approx(integrated_correlation(noise))
    assert integrated_correlation(noise) > 5
    assert integrated_correlation(np.zeros(100)) == 1

"""The paper's protocol, step by step, on recordings whose right answer can be worked out by hand."""

from collections import Counter

import numpy as np
import pytest

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.dataset import load_dataset
from tactbench.core.evaluation.protocols import KARL2016
from tactbench.core.evaluation.sets import FeatureScale, keep, moments, part
from tactbench.core.evaluation.splits import make_splits

from .made import evaluated, force_task, ramp, record, roles


def kept_rows(paths):
    """Return the rows that are kept for the test, the same scaled, and what was counted."""
    data, counts = load_dataset(force_task(), paths), Counter()
    kept = keep(data, KARL2016, make_splits(data, "roles", 0)[0].test, "test", counts)
    return kept, part(kept, FeatureScale(*moments(kept.X)), 0), counts


def test_a_sample_goes_if_any_channel_is_beyond_three_sigma_of_its_set(tmp_path):
    def with_outliers(seed):
        X, force = ramp(seed)
        X[700, 1] += 5000.0
        X[100, 0] += 5000.0  # among the first 600: dropped anyway
        X[900, 2] += 3.5 * X[600:, 2].std() - (X[900, 2] - X[600:, 2].mean())
        force[800] -= 500.0
        return X, force

    kept, _, counts = kept_rows(roles(tmp_path, with_outliers))
    assert [n for text, n in counts.items() if "force" in text] == [1]
    X, force = with_outliers(2)
    late = np.column_stack([X, force])[600:]
    by_hand = (np.abs(late - late.mean(axis=0)) <= 3 * late.std(axis=0)).all(axis=1)
    assert not by_hand[[100, 200, 300]].any()
    assert kept.row.tolist() == (np.flatnonzero(by_hand) + 600).tolist()


def test_each_set_is_scaled_by_its_own_mean_and_deviation_all_its_recordings_pooled(tmp_path):
    paths = roles(tmp_path)
    paths.append(record(tmp_path / "test-b.h5", *ramp(9, gain=(10.0, 5.0, 1.0)), role="test", session="test"))
    kept, one, _ = kept_rows(paths)
    assert set(kept.recording.tolist()) == {2, 3}
    # Means of 2000 z-scores: rounding only.
    np.testing.assert_allclose(one.X.mean(axis=0), 0.0, atol=1e-10)
    np.testing.assert_allclose(one.X.std(axis=0), 1.0, atol=1e-10)
    assert np.abs(one.X[one.recording == 3].mean(axis=0)).max() > 0.1  # not each recording by itself


def test_a_channel_that_never_changes_becomes_zero_and_is_reported(tmp_path):
    def stuck(seed):
        X, force = ramp(seed)
        X[:, 2] = 243.7
        return X, force

    paths = roles(tmp_path, stuck)
    _, one, _ = kept_rows(paths)
    assert not one.X[:, 2].any()
    assert [n for text, n in run(paths).counts.items() if "t2" in text] == [1]


def run(paths, estimator="lasso", **more):
    return evaluated(force_task(), paths, estimator, "karl2016", **{"seed": 0, **more})


def test_lasso_on_one_perfect_feature_is_wrong_by_exactly_lambda(tmp_path):
    """Objective 1/2n |y - Xb|² + l |b|: b = sd(y) - l, so the error is l times a unit z-score."""
    paths = roles(tmp_path, lambda seed: ramp(seed, gain=(50.0,), noise=0.0))
    result = run(paths, params={"lambda_": 0.2})
    assert result.chosen["k"] == 0
    assert result.dagger
    assert result.score == pytest.approx(0.2, rel=1e-3)  # the solver stops at a duality gap of 1e-5 of y's square


def test_hyper_parameters_are_chosen_on_validation_and_never_see_the_test_set(tmp_path):
    def altered(changed):
        def make(place):
            X, force = ramp(place, label_noise=0.5)
            return (X, force[::-1]) if place == changed else (X, force)

        return run(roles(tmp_path / f"{changed}", make))

    one, validation, test = (altered(place) for place in (None, 1, 2))
    assert set(one.sets) == {"train", "validation", "test"}
    assert one.chosen == test.chosen
    assert one.score != test.score
    assert one.scores["validation"] != validation.scores["validation"]


def test_it_needs_the_three_roles_and_no_other_split(tmp_path):
    paths = roles(tmp_path)
    with pytest.raises(NotApplicable, match="roles"):
        run(paths, split="session")
    with pytest.raises(NotApplicable, match="deployable"):
        run(paths[:2])

"""What estimators do before they are timed."""

import pytest

from tactbench.core.evaluation.warm_up import rehearse
from tactbench.core.plugins.registry import load_object, load_registry

ESTIMATORS = [(one, kind) for one in load_registry().estimators if one.rehearsal is not None for kind in one.kinds]


@pytest.mark.parametrize(("one", "kind"), ESTIMATORS, ids=lambda value: getattr(value, "name", value))
def test_every_estimator_of_ours_can_be_rehearsed(one, kind):
    assert set(one.rehearsal) <= set(one.params)
    rehearse(load_object(one.where)(kind=kind, seed=0, threads=1, **{**one.params, **one.rehearsal}), kind)

"""A vector for every sample: scored by the length of the difference, one model per component."""

import numpy as np
import pytest

from tactbench.core.plugins.registry import load_registry
from tactbench.core.samples import Quality
from tactbench.plugin import Block, ChannelSpec, ChannelTarget, StreamSpec, VectorTarget
from tests.core.evaluation.made import evaluated, force_task, sensor, write

REGISTRY = load_registry()
PLACE = StreamSpec(
    name="place", channels=tuple(ChannelSpec(name=name, kind="position", unit="m") for name in ("x", "y"))
)
BOTH = VectorTarget(names=("x", "y"), unit="mm")
MIX = np.array([[3.0, 1.0, -2.0], [0.5, -4.0, 1.0]])
"""Of taxels (3) from a place (2)."""


def place_task(target=BOTH, metric="mean_euclidean_error"):
    return force_task(name="place", target=target, metric=metric, unit="mm")


def presses(folder, missing=0):
    """Recordings at a place each [m], wandering a little about it; the first `missing` rows have no place."""
    rng, n = np.random.default_rng(3), 60
    paths = []
    for place, role in enumerate(("train",) * 6 + ("test",) * 6):
        where = rng.uniform(-0.005, 0.005, 2) + rng.normal(0, 2e-4, (n, 2))
        X = 1e3 * where @ MIX + 3.0 * rng.normal(size=(n, 3))
        quality = np.zeros((n, 2), dtype=np.uint8)
        quality[:missing, 1] = Quality.MISSING
        t_ns = np.arange(n, dtype=np.int64) * 10_000_000
        blocks = Block("taxels", t_ns, X), Block("place", t_ns, where, quality)
        about = {"reference": (PLACE,), "session": f"s{place}", "role": role}
        paths.append(write(folder / f"p{place:02d}.h5", sensor(3), *blocks, **about))
    return paths


def run(task, paths, estimator="ols", **more):
    return evaluated(task, paths, estimator, "deployable-untared", **more)


@pytest.mark.parametrize("estimator", ["lasso", "forest-10", "knn"])
def test_each_component_is_learnt_as_if_it_were_asked_for_alone(tmp_path, estimator):
    """Parameters that are searched are fixed: a vector has one choice for all of its components."""
    paths = presses(tmp_path)
    fixed = {name: values[0] for name, values in REGISTRY.estimators[estimator].grid.items()}
    descriptor = REGISTRY.estimators[estimator].model_copy(update={"window_grid": (0,)})

    def answered(task):
        return run(task, paths, descriptor, params=fixed).sets["test"].y_pred

    both = answered(place_task())
    for column, name in enumerate(("x", "y")):
        alone = place_task(target=ChannelTarget(kind="position", name=name, unit="mm"), metric="rmse")
        np.testing.assert_array_equal(both[:, column], answered(alone))

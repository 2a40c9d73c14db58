"""Three-axis force, asked of recordings that were made elsewhere: the twin's taxels do not answer to shear."""

import numpy as np

from tactbench.plugin import Block, ChannelSpec, StreamSpec
from tactbench.tasks.force import THREE_AXIS as SPEC
from tests.core.evaluation.made import evaluated, sensor, write

LOAD_CELL = StreamSpec(
    name="load_cell", channels=tuple(ChannelSpec(name=name, kind="force", unit="mN") for name in ("fx", "fy", "fz"))
)
MIX = np.array([[2.0, -1.0, 0.5, 0.0], [0.0, 1.5, 1.0, -2.0], [1.0, 1.0, -1.0, 1.0]])


def test_all_three_components_are_answered_in_newtons(tmp_path):
    rng = np.random.default_rng(4)
    t_ns = np.arange(80, dtype=np.int64) * 10_000_000
    paths = []
    for place in range(6):
        force_n = np.cumsum(rng.normal(0, 0.2, (80, 3)), axis=0)
        blocks = Block("taxels", t_ns, force_n @ MIX), Block("load_cell", t_ns, 1e3 * force_n)
        about = {"reference": (LOAD_CELL,), "session": f"s{place}"}
        paths.append(write(tmp_path / f"p{place}.h5", sensor(4), *blocks, **about))
    found = evaluated(SPEC, paths)
    assert found.split == "session"
    assert found.score < 1e-9, "four taxels that are linear in three forces: rounding is all that is left"
    assert {"RMSE of fx", "RMSE of fy", "RMSE of fz"} < set(found.scores)
    assert evaluated(SPEC, paths, "mean").score > 0.5
    np.testing.assert_allclose(1e-3 * found.sets["test"].force_n, found.sets["test"].y_true[:, 2])

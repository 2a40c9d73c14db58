"""Three-axis force, asked of recordings that were made elsewhere: the twin's taxels do not answer to shear."""

import time

import numpy as np
import pytest

from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import Block, ChannelSpec, StreamSpec
from tactbench.tasks.three_axis_force import SPEC
from tests.core.evaluation.made import sensor

LOAD_CELL = StreamSpec(
    name="load_cell", channels=tuple(ChannelSpec(name=name, kind="force", unit="mN") for name in ("fx", "fy", "fz"))
)
MIX = np.array([[2.0, -1.0, 0.5, 0.0], [0.0, 1.5, 1.0, -2.0], [1.0, 1.0, -1.0, 1.0]])


def pushes(folder, number=6, n=80):
    rng = np.random.default_rng(4)
    paths = []
    for place in range(number):
        force_n = np.cumsum(rng.normal(0, 0.2, (n, 3)), axis=0)
        about = RecordingMeta(
            name=f"p{place}", sensor=sensor(4), reference=(LOAD_CELL,), rig="made", clock="device", session=f"s{place}"
        )
        paths.append(folder / f"p{place}.h5")
        t_ns = np.arange(n, dtype=np.int64) * 10_000_000
        with RecordingWriter(paths[-1], about) as writer:
            writer.append(Block("taxels", t_ns, force_n @ MIX))
            writer.append(Block("load_cell", t_ns, 1e3 * force_n))
    return paths


def test_all_three_components_are_answered_in_newtons(tmp_path):
    def run(estimator):
        context = CellContext(
            SPEC, installed().estimators[estimator], {}, "deployable", None, 1, time.perf_counter, latency=False
        )
        return evaluate_cell(context, paths)

    paths = pushes(tmp_path)
    found = run("ols")
    assert found.split == "session"
    assert found.score < 1e-9, "four taxels that are linear in three forces: rounding is all that is left"
    assert {"RMSE of fx", "RMSE of fy", "RMSE of fz"} < set(found.scores)
    trivial = run("mean")
    length = np.linalg.norm(trivial.sets["test"].y_pred - trivial.sets["test"].y_true, axis=1)
    assert trivial.score == pytest.approx(length.mean())
    assert trivial.score > 0.5
    np.testing.assert_allclose(1e-3 * found.sets["test"].force_n, found.sets["test"].y_true[:, 2])

"""Cells that do nothing, for measuring what is around them: a plugin with one task and one estimator, tiny recordings.

Used by kill_nine.py.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np

from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.spec.matrix import MatrixSpec, TaskChoice
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import Block, ChannelSpec, SensorSpec, Source, StreamSpec

ROWS = 12
PLUGIN = '''
"""One question that nobody asks, and one answer that costs nothing."""
import numpy as np
from tactbench.plugin import ChannelTarget, EstimatorDescriptor, TaskDescriptor, TaskSpec, hookimpl

TACTBENCH_API = 2


class Nothing:
    def fit(self, X, y):
        return self

    def predict(self, X):
        return np.zeros(len(X))


def nothing(*, kind, seed, threads, step=0):
    return Nothing()


@hookimpl
def tactbench_tasks():
    return [TaskDescriptor(spec=TaskSpec(
        name="nothing-asked", title="Nothing", question="What is nothing?", kind="regression", target=ChannelTarget(),
        metric="mae", unit="N", protocols=("deployable",), splits=("session",), estimators=("nothing",), baselines=()))]


@hookimpl
def tactbench_estimators():
    return [EstimatorDescriptor(name="nothing", title="Nothing", kinds=("regression",), params={"step": 0},
                                where="tactbench_nothing:nothing")]
'''


def install(folder: Path) -> Path:
    """Write the plugin as an installer leaves it, and the recordings; return the folder of the recordings."""
    about = folder / "tactbench_nothing-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: tactbench-nothing\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[tactbench]\nnothing = tactbench_nothing\n")
    (folder / "tactbench_nothing.py").write_text(PLUGIN)
    for session in ("one", "two"):
        _record(folder / "shelf" / f"{session}.h5", session)
    return folder / "shelf"


def use(folder: Path) -> None:
    """Let this process, and those that it starts, find the plugin."""
    sys.path.insert(0, str(folder))
    os.environ["PYTHONPATH"] = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])


def with_byte_code() -> dict[str, str]:
    """Return the environment for processes to be timed: they keep byte code, though tests may have switched it off."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def matrix(cells: int) -> MatrixSpec:
    """Return a matrix of so many cells."""
    choice = TaskChoice(name="nothing-asked", protocol="deployable", split="session", estimators=("nothing",))
    return MatrixSpec(rig="replay", repeats=cells, tasks=(choice,), latency=False)


def _record(path: Path, session: str) -> None:
    taxels = StreamSpec(name="taxels", channels=(ChannelSpec(name="t", kind="taxel"),))
    reference = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
    sensor = SensorSpec(name="tiny", title="Tiny", principle="none", streams=(taxels,),
                        principle_source=Source(tag="assumed", reference="a benchmark"))  # fmt: skip
    about = RecordingMeta(name=session, sensor=sensor, reference=(reference,), rig="made", session=session)
    times = np.arange(ROWS, dtype=np.int64) * 10_000_000
    force = np.linspace(0.0, 5.0, ROWS)[:, None]
    path.parent.mkdir(parents=True, exist_ok=True)
    with RecordingWriter(path, about) as writer:
        writer.append(Block("taxels", times, force + 1.0))
        writer.append(Block("force_torque", times, force))

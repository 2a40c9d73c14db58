"""A result folder by the real pipeline: two made-up sensors, the paper's two questions, small recordings."""

import numpy as np

from tactbench.core.matrix.run import run_matrix
from tactbench.core.matrix.store import Store
from tactbench.core.plugins.registry import load_registry
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.report.figures.group import groups
from tactbench.core.report.results import open_results
from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import Block, ChannelSpec, SensorSpec, Source, StreamSpec
from tests.here import IN_THIS_PROCESS

REGISTRY = load_registry()
DISCARDED = 600
"""Rows that the paper's protocol drops at the start."""
KEPT = 50
FORCE = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))
TREES = EstimatorChoice(name="forest", params={"n_estimators": 8})


def sensor(name):
    channels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(4))
    return SensorSpec(
        name=name, title="Made by hand", principle="none", principle_source=Source(tag="assumed", reference="a test"),
        streams=(StreamSpec(name="taxels", channels=channels),),
    )  # fmt: skip


def record(folder, name, noise, seed, kept, *, simulated=True, tasks=("force", "curvature")):
    """Write every scene of the tasks: taxels see force and radius through noise."""
    rng = np.random.default_rng(seed)
    for planned in (planned for task in tasks for planned in REGISTRY.tasks[task].spec.scenes):
        radius = planned.scene.labels.get("cap_radius_mm", 20.0)
        force = np.concatenate([np.zeros(DISCARDED), np.linspace(0.0, 5.0, kept)])
        seen = np.column_stack([force, force * radius / 20, force / radius, np.sqrt(np.maximum(force, 0)) * radius])
        X = 1000 + 10 * seen + rng.normal(0, noise, seen.shape)
        about = RecordingMeta(
            name=planned.scene.name, sensor=sensor(name), reference=(FORCE,), rig="made", simulated=simulated,
            role=planned.role, session=planned.scene.session, scene=planned.scene, labels=planned.scene.labels,
        )  # fmt: skip
        path = folder / name / f"{planned.scene.name}.h5"
        path.parent.mkdir(parents=True, exist_ok=True)
        t_ns = np.arange(len(X), dtype=np.int64) * 100_000_000  # a mean over one second is one of eleven rows
        with RecordingWriter(path, about) as writer:
            writer.append(Block("taxels", t_ns, X, None))
            writer.append(Block("force_torque", t_ns, (force + rng.normal(0, 0.1, len(force)))[:, None]))


def results(folder, *, sensors=("alpha", "beta"), kept=KEPT, simulated=True, protocol="karl2016", split=None,
            tasks=("force", "curvature")):  # fmt: skip
    """Record, run, and return the result folder."""
    recordings = folder / "recordings"
    for place, name in enumerate(sensors):
        record(recordings, name, 2.0 + 6.0 * place, place, kept, simulated=simulated, tasks=tasks)
    asked = {"force": ("lasso",), "curvature": (TREES,)}
    matrix = MatrixSpec(
        rig="replay",
        tasks=tuple(TaskChoice(name=name, protocol=protocol, split=split, estimators=asked[name]) for name in tasks),
    )
    run_matrix(matrix, Store(folder / "results"), choice=IN_THIS_PROCESS, recordings=recordings)
    return folder / "results"


def opened(folder):
    return open_results(Store(folder), REGISTRY)


def group_of(folder, task):
    said = []
    (found,) = [group for group in groups(opened(folder), said.append) if group.task.name == task]
    return found

"""Recordings made by hand, in real files."""

import itertools

import numpy as np

from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.writer import RecordingWriter
from tactbench.core.samples import Quality
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import Block, ChannelSpec, ChannelTarget, LabelTarget, SensorSpec, Source, StreamSpec, TaskSpec

FORCE = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))


def sensor(n_taxels=3):
    channels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(n_taxels))
    return SensorSpec(
        name="made", title="Made by hand", principle="none",
        principle_source=Source(tag="assumed", reference="a test"),
        streams=(StreamSpec(name="taxels", channels=channels),),
    )  # fmt: skip


def record(path, X, force=None, *, t_ns="regular", annotations=None, quality=None, **meta):
    """Write a recording with taxels `X` (n, p), a force (n,) and annotations; return its path."""
    X = np.asarray(X, dtype=np.float64)
    if isinstance(t_ns, str):
        t_ns = np.arange(len(X), dtype=np.int64) * 10_000_000
    reference = (FORCE,) if force is not None else ()
    clock = "none" if t_ns is None else "device"
    about = RecordingMeta(
        name=path.stem, sensor=sensor(X.shape[1]), reference=reference, rig="made", clock=clock, **meta
    )
    with RecordingWriter(path, about) as writer:
        writer.append(Block("taxels", t_ns, X, quality))
        if force is not None:
            values = np.asarray(force, dtype=np.float64)[:, None]
            writer.append(Block("force_torque", t_ns, values, np.isnan(values).astype(np.uint8) * int(Quality.MISSING)))
        for name, values in (annotations or {}).items():
            writer.annotate("taxels", name, values)
    return path


def force_task(**more):
    return TaskSpec(**{
        "name": "force", "title": "t", "question": "?", "kind": "regression", "target": ChannelTarget(kind="force"),
        "metric": "rmse", "unit": "N", "protocols": ("karl2016", "deployable"), "estimators": ("lasso",),
        "splits": ("roles", "session", "in-session", "shuffled"), "baselines": ("mean",), **more,
    })  # fmt: skip


def label_task(name="kind", **more):
    return TaskSpec(**{
        "name": "label", "title": "t", "question": "?", "kind": "classification", "target": LabelTarget(name=name),
        "metric": "macro_f1", "protocols": ("karl2016", "deployable"), "estimators": ("forest",),
        "splits": ("roles", "object", "session", "shuffled"), "baselines": ("majority",), **more,
    })  # fmt: skip


def ticking():
    """A clock that moves on at each look."""
    counter = itertools.count()
    return lambda: next(counter) * 2.0**-10


def evaluated(task, recordings, estimator="ols", protocol="deployable", split=None, *, params=None, **more):
    """Return what a cell comes to; no answer is timed unless `latency` is given."""
    given = installed().estimators[estimator] if isinstance(estimator, str) else estimator
    context = CellContext(
        task, given, params or {}, protocol, split, **{"seed": 1, "clock": ticking(), "latency": False, **more}
    )
    return evaluate_cell(context, recordings)

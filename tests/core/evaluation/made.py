"""Recordings made by hand, in real files."""

import itertools

import numpy as np

from tactbench.core.evaluation.cell import CellContext, evaluate_cell
from tactbench.core.plugins.registry import installed
from tactbench.core.recording.writer import write_recording
from tactbench.core.samples import Quality
from tactbench.core.spec.recording import RecordingMeta
from tactbench.plugin import (
    Block,
    ChannelSpec,
    ChannelTarget,
    ForceRamp,
    LabelTarget,
    Scene,
    SensorSpec,
    Source,
    StreamSpec,
    TaskSpec,
    assumed,
)  # fmt: skip

FORCE = StreamSpec(name="force_torque", channels=(ChannelSpec(name="fz", kind="force", unit="N"),))


def sensor_of(*streams, name="made"):
    source = Source(tag="assumed", reference="a test")
    return SensorSpec(name=name, title="Made by hand", principle="none", principle_source=source, streams=streams)


def sensor(n_taxels=3, name="made"):
    channels = tuple(ChannelSpec(name=f"t{place}", kind="taxel") for place in range(n_taxels))
    return sensor_of(StreamSpec(name="taxels", channels=channels), name=name)


def write(path, sensor, *blocks, annotations=None, clock="device", **meta):
    """Write a recording of these blocks, and annotations of taxels; return its path."""
    about = RecordingMeta(name=path.stem, sensor=sensor, rig="made", clock=clock, **meta)
    notes = {name: np.asarray(values) for name, values in (annotations or {}).items()}
    write_recording(path, about, blocks, {"taxels": notes})
    return path


def record(path, X, force=None, *, t_ns="regular", quality=None, called="made", **more):
    """Write a recording with taxels `X` (n, p), a force (n,) and annotations; return its path."""
    X = np.asarray(X, dtype=np.float64)
    if isinstance(t_ns, str):
        t_ns = np.arange(len(X), dtype=np.int64) * 10_000_000
    more["clock"] = "none" if t_ns is None else "device"
    if force is None:
        return write(path, sensor(X.shape[1], called), Block("taxels", t_ns, X, quality), **more)
    values = np.asarray(force, dtype=np.float64)[:, None]
    forces = Block("force_torque", t_ns, values, np.isnan(values).astype(np.uint8) * int(Quality.MISSING))
    taxels = Block("taxels", t_ns, X, quality)
    return write(path, sensor(X.shape[1], called), taxels, forces, reference=(FORCE,), **more)


def ramp(seed, n=1600, gain=(50.0, -20.0, 7.0), noise=1.0, label_noise=0.0):
    """Taxels that follow a rising force, and the force."""
    rng = np.random.default_rng(seed)
    force = np.linspace(0.0, 5.0, n)
    X = 1000 + force[:, None] * np.array(gain) + rng.normal(0, noise, (n, len(gain)))
    return X, force + rng.normal(0, label_noise, n)


def sessions(folder, names=("a", "b", "c"), n=200, make=ramp, **more):
    """Recordings of what `make` gives for a seed and `n` rows, one a session."""
    return [record(folder / f"{name}.h5", *make(place, n=n), session=name, **more)
            for place, name in enumerate(names)]  # fmt: skip


def roles(folder, make=ramp, **more):
    """Recordings of what `make` gives for a seed, one a role."""
    return [record(folder / f"{role}.h5", *make(place), role=role, session=role, **more)
            for place, role in enumerate(("train", "validation", "test"))]  # fmt: skip


def grasps(folder, role=None, objects=12, each=20, seed=0):
    """One recording of grasps that hold or slip, each a row of an object."""
    rng = np.random.default_rng(seed)
    names = np.repeat([f"thing {place}" for place in range(objects)], each)
    y = rng.integers(0, 2, len(names))
    X = rng.normal(size=(len(names), 3)) + y[:, None] + 3 * rng.normal(size=(objects, 3)).repeat(each, axis=0)
    return record(
        folder / f"grasps{role}{seed}.h5", X, t_ns=None, role=role, session=f"file {seed}",
        annotations={"object": names, "kind": np.where(y, "slipped", "stable")},
    )  # fmt: skip


def held(name, hold_s, **more):
    """A scene that presses after an unloaded hold."""
    profile = {one: more.pop(one) for one in ("start", "duration", "samples") if one in more}
    return Scene(name=name, profile=ForceRamp(hold=assumed(hold_s, "s", "a test"), **profile), **more)


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

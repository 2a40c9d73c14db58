"""Whole rows of one made-up cell of each kind, which stay what they were: every number, text and answer.

``python -m tests.core.evaluation.test_rows`` writes them anew, to be looked at.
"""

import json
import math
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from sklearn.linear_model import Ridge
from sklearn.model_selection import GroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from tactbench.core.evaluation.folds import PLAIN
from tactbench.core.evaluation.metrics import Metric
from tactbench.core.evaluation.splits import OwnSplit
from tactbench.plugin import Summary
from tactbench.tasks import slip

from . import made_slip, test_per_recording, test_vectors
from .made import evaluated, force_task, grasps, held, label_task, ramp, record, roles, sessions

FILE = Path(__file__).with_name("rows.json")
TIMED = partial(evaluated, latency=True)


def presses(folder, names, simulated=True, n=300):
    """Presses under 60 s of a scene with a hold, one a session; the reference has noise of 0.3 N."""
    t_ns = np.linspace(0, 60e9, n).astype(np.int64)
    force = np.interp(t_ns * 1e-9, [0, 7.2, 60], [0, 0, 5])

    def make(seed, n):
        noise = np.random.default_rng(seed).normal(size=(n, 4))
        return 10 * seed + force[:, None] * [5.0, -2.0, 1.0] + (1 + seed) * noise[:, :3], force + 0.3 * noise[:, 3]

    scene = held("held", 7.2, samples=n)
    return sessions(folder, names, n, make, t_ns=t_ns, scene=scene, simulated=simulated)


def separable(folder, wrong):
    """Readings that name the class, but for some rows of the first two of eight objects."""
    kind = np.tile([0, 1], 80)
    X = np.where(np.isin(np.arange(160), wrong), 1 - kind, kind)[:, None] * 20.0 + np.random.default_rng(0).random(
        (160, 2)
    )
    notes = {"object": np.repeat(list("abcdefgh"), 20), "kind": np.array(["no", "yes"])[kind]}
    return [record(folder / "a.h5", X, t_ns=None, annotations=notes)]


def by_shots(folder):
    named = [("train", f"day-{n}") for n in (2, 9, 10)] + [("test", f"day-{n}") for n in range(20, 26)]
    return [
        record(folder / f"{name}.h5", *ramp(n, n=80), role=role, session=name) for n, (role, name) in enumerate(named)
    ]


def flat(windows):
    return windows.reshape(len(windows), -1)


def own(folder):
    weights, groups = np.linspace(1, 2, 342), np.repeat(np.arange(6), 57)
    paths = sessions(folder, "abcdef", n=60)
    return evaluated(
        force_task(), paths, PLAIN, given=make_pipeline(FunctionTransformer(flat), Ridge()), window=4, step=1,
        split=OwnSplit(GroupKFold(3), groups),
        metric=Metric("mean distance", "regression", None, None, function=lambda y, p: np.mean(np.abs(y - p))),
        fit_params={"ridge__sample_weight": weights},
    )  # fmt: skip


def slips(folder, spec, estimator, loud=1.3, tapped=1.3, **more):
    task = spec.model_copy(update={"scenes": (), "splits": ("roles", "session")})
    return TIMED(task, made_slip.campaign(folder, number=2, tapped=tapped, loud=loud), estimator, **more)


WINDOWED = test_per_recording.task(
    summaries=(Summary(measure="range", start=0.125, end=0.5), Summary(measure="change", start=0.5)),
)  # fmt: skip
CELLS = {
    "force": lambda folder: TIMED(force_task(), presses(folder, "abcdef"), "ridge"),
    "force of a real rig": lambda folder: TIMED(force_task(), presses(folder, "abcdefg", False), "knn"),
    "paper": lambda folder: TIMED(force_task(), roles(folder, partial(ramp, n=700)), "ridge", "karl2016"),
    "thinned": lambda folder: TIMED(force_task(), sessions(folder), "ols", "deployable@every=2,k=3", "in-session"),
    "few shots": lambda folder: TIMED(force_task(metric="r2"), by_shots(folder), "ridge", split="few-shot-2"),
    "by object": lambda folder: TIMED(label_task(), [grasps(folder, seed=1), grasps(folder, seed=2)], "knn"),
    "one mistake": lambda folder: TIMED(label_task(metric="accuracy"), separable(folder, [3]), "knn", split="object"),
    "few mistakes": lambda folder: TIMED(
        label_task(metric="accuracy"), separable(folder, [*range(5), *range(20, 30)]), "logistic", split="object"
    ),
    "shuffled": lambda folder: TIMED(label_task(), separable(folder, []), "majority", split="shuffled"),
    "summaries": lambda folder: TIMED(test_per_recording.FAST, test_per_recording.two_rates(folder), "logistic"),
    "windows in time": lambda folder: TIMED(WINDOWED, test_per_recording.sequences(folder, 12), "logistic"),
    "whole, shuffled": lambda folder: TIMED(
        test_per_recording.task(), test_per_recording.sequences(folder, 12), "logistic", split="shuffled"
    ),
    "vector": lambda folder: TIMED(
        test_vectors.place_task(), test_vectors.presses(folder, 15), "ridge", "deployable-untared", "session"
    ),
    "slips": lambda folder: slips(folder, slip.SPEC, "pac-band"),
    "slips by session": lambda folder: slips(folder, slip.SPEC, "frame-difference", 1.25, 1.2, split="session"),
    "oracle of slips": lambda folder: slips(folder, slip.SPEC, "force-ratio"),
    "states": lambda folder: slips(folder, slip.STATE, "knn"),
    "of the caller": own,
}


def row_of(name):
    """Return the row of a cell, with sums over its answers in place of these."""
    with tempfile.TemporaryDirectory() as folder:
        result = CELLS[name](Path(folder))
    row = result.model_dump(mode="json", exclude={"peak_rss_mb"}, exclude_defaults=True)
    row["answers"] = {
        role: {name: float(np.nansum(np.transpose(column) * np.arange(1, len(column) + 1)))
               for name, column in vars(answers).items()}
        for role, answers in result.sets.items()
    }  # fmt: skip
    return row


def apart(found, known, path=""):
    """Yield where two rows differ, numbers by more than solvers of other versions may."""
    if isinstance(known, dict) and isinstance(found, dict):
        for key in {**known, **found}:
            yield from apart(found.get(key), known.get(key), f"{path}/{key}")
    elif isinstance(known, list) and isinstance(found, list) and len(known) == len(found):
        for place, (one, other) in enumerate(zip(found, known, strict=True)):
            yield from apart(one, other, f"{path}/{place}")
    elif isinstance(known, float) and isinstance(found, float):
        if not math.isclose(found, known, rel_tol=1e-4, abs_tol=1e-7):
            yield f"{path}: {found} was {known}"
    elif found != known:
        yield f"{path}: {found!r} was {known!r}"


@pytest.mark.parametrize("name", CELLS)
def test_a_row_is_what_it_was(name):
    known = json.loads(FILE.read_text(encoding="utf-8"))[name]
    assert list(apart(json.loads(json.dumps(row_of(name))), known)) == []


if __name__ == "__main__":
    lines = {
        name: ",\n".join(f'  "{key}": {json.dumps(value)}' for key, value in row_of(name).items()) for name in CELLS
    }
    rows = ",\n".join(f' "{name}": {{\n{line}\n }}' for name, line in lines.items())
    FILE.write_text(f"{{\n{rows}\n}}\n", encoding="utf-8")

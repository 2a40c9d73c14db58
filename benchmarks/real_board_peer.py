"""The figures of the real board once more, by numpy and scikit-learn (openpyxl reads sheets), from the published files.

Nothing of tactbench is imported: files are read, folds are made, features are scaled and scores are computed here.
Beside each figure stands that of a board (`leaderboard.json` of `tactbench run --config real`), the difference, and
where a forest differs the range of the plain one over more seeds; nothing else depends on a seed. `chance` is left out.

Usage: python benchmarks/real_board_peer.py DATA [--board FOLDER/leaderboard.json] [--seeds 3]
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from openpyxl import load_workbook
from sklearn.ensemble import (
    ExtraTreesRegressor,
    HistGradientBoostingClassifier,
    HistGradientBoostingRegressor,
    RandomForestClassifier,
    RandomForestRegressor,
)
from sklearn.linear_model import LinearRegression, LogisticRegression
from sklearn.preprocessing import StandardScaler

NEWTON_PER_GRAM = 9.80665e-3
Array = np.ndarray[Any, Any]


@dataclass
class Question:
    """Rows, answers, and the folds: pairs of masks over rows."""

    sensor: str
    task: str
    protocol: str
    split: str
    X: Array
    y: Array
    folds: list[tuple[Array, Array]]
    trees: int
    """Of the forest; 0: extremely randomised trees in its place"""
    row: Array | None = None
    answered: Array | None = None
    """Rows with an answer; the others are only scaled by"""
    boosting: bool = True


def eflesh_force(data: Path) -> Iterator[Question]:
    """Yield two sessions of ten presses, baselined; rows without a load-cell sample have no answer."""
    sessions = sorted((data / "eflesh/characterization/datasets/normal_force").glob("*_probe"))
    tables = [np.loadtxt(one / "sensor_post_baselines.csv", delimiter=",") for one in sessions]
    gram = np.concatenate([np.loadtxt(one / "states.csv", delimiter=",", usecols=4) for one in sessions])
    session = np.repeat(np.arange(len(tables)), [len(one) for one in tables])
    answered = gram != -1
    shared = {
        "sensor": "eflesh", "task": "force", "protocol": "deployable",
        "X": np.concatenate([one[:, 1:] for one in tables]), "y": gram * NEWTON_PER_GRAM,
        "trees": 100, "answered": answered,
        "row": np.concatenate([np.arange(float(len(one))) for one in tables]),
    }  # fmt: skip
    yield Question(split="session", folds=[(session != one, session == one) for one in range(len(tables))], **shared)
    folds = []
    for one in range(len(tables)):
        rows = np.flatnonzero((session == one) & answered)
        cut = np.arange(len(session)) >= rows[int(0.8 * len(rows))]
        folds.append(((session == one) & ~cut, (session == one) & cut))
    yield Question(split="in-session", folds=folds, **shared)


def eflesh_location(data: Path) -> Iterator[Question]:
    """Yield two sessions of presses on a grid, raw readings."""
    sessions = sorted((data / "eflesh/characterization/datasets/spatial_resolution").glob("*_probe"))
    tables = [np.loadtxt(one / "sensor.csv", delimiter=",") for one in sessions]
    places = [np.loadtxt(one / "states.csv", delimiter=",", usecols=(1, 2)) for one in sessions]
    session = np.repeat(np.arange(len(tables)), [len(one) for one in tables])
    yield Question(
        "eflesh-location", "contact-location", "deployable", "session", np.concatenate([one[:, 1:] for one in tables]),
        np.concatenate(places), [(session != one, session == one) for one in range(len(tables))], 100,
        row=np.concatenate([np.arange(float(len(one))) for one in tables]),
    )  # fmt: skip


def eflesh_slip(data: Path) -> Iterator[Question]:
    """Yield a row a sequence: deviation, mean absolute step, last less first and range of each channel."""
    with np.load(data / "eflesh/slip_detection/slip_sequences.npz") as archive:
        X, y = archive["X"].astype(float), archive["y"]
    measures = (X.std(1), np.abs(np.diff(X, axis=1)).mean(1), X[:, -1] - X[:, 0], np.ptp(X, axis=1))
    words = np.array(["stable", "slipped"])[y]
    folds = dealt([str(block) for block in np.arange(len(y)) // 18])
    X = np.concatenate(measures, axis=1)
    yield Question("eflesh-slip", "slip-sequence", "deployable", "block", X, words, folds, 500)


def biotacsp(data: Path) -> Iterator[Question]:
    """Yield a row a grasp of the three files that train, split by object."""
    rows: list[list[str]] = []
    for name in ("palm_45", "palm_down", "palm_side"):
        text = (data / f"biotacsp-stability-v2/bts3v2_{name}.csv").read_text().splitlines()
        rows += [line.split(",") for line in text[1:]]
    cells = np.array(rows)
    yield Question(
        "biotac-sp", "grasp-stability", "deployable", "object", cells[:, 2:].astype(float),
        np.array(["stable", "slipped"])[cells[:, 1].astype(int)], dealt(cells[:, 0].tolist()), 300,
    )  # fmt: skip


def icub(data: Path) -> Iterator[Question]:
    """Yield a row a frame, split by trial; then the first frame of each trial alone."""
    frames, objects, trials, first = [], [], [], []
    for path in sorted((data / "icub-grasp/iCubGraspDataset").glob("*.txt")):
        name, trial = path.stem.rsplit("_", 1)
        if name == "full_coke":
            continue
        lines = [line for line in path.read_text().splitlines()[1:] if line.strip()]
        for place in range(0, len(lines), 7):
            frames.append(" ".join(lines[place + 2 : place + 7]).split())
            objects.append(name)
            trials.append(trial)
            first.append(place == 0)
    X, y, begins = np.array(frames, float), np.array(objects), np.array(first)
    yield Question("icub-hand", "object-identity", "deployable", "trial", X, y, dealt(trials), 100)
    folds = [(train & begins, test & begins) for train, test in dealt(trials)]
    yield Question("icub-hand", "object-identity", "first-frame", "trial", X, y, folds, 100)


def fluid(data: Path) -> Iterator[Question]:
    """Yield the presses of each of nine sensors; each of eight segments of 10 mm is held out in turn."""
    for path in sorted((data / "fsi/Machine Learning").glob("*.xlsx")):
        header, *rows = load_workbook(path, read_only=True, data_only=True).worksheets[0].iter_rows(values_only=True)
        table = np.array(rows, float)
        place, left, right, force = (table[:, header.index(name)] for name in ("X", "Pl", "Pr", "F"))
        segment = np.minimum(place // 10, 8)
        medium, diameter = path.stem.removeprefix("1D_").split("_dia")
        yield Question(
            f"fluid-{medium}-{diameter.lstrip('_')}", "force", "deployable", "placement", np.stack([left, right], 1),
            force, [(segment != one, segment == one) for one in np.unique(segment)], trees=0,
        )  # fmt: skip


def biotac_slide(data: Path) -> Iterator[Question]:
    """Yield slides of a BioTac, in five blocks of ten repetitions."""
    names = [f"ele{one}" for one in range(1, 20)] + ["pdc"] + [f"pac{one}" for one in range(1, 23)] + ["tdc", "tac"]
    slides, materials, blocks = [], [], []
    for path in sorted((data / "biotac-slide/raw_data").glob("*/*.csv"), key=lambda one: one.name.replace("_", "-")):
        header, *lines = path.read_text().splitlines()
        places = [header.split(",").index(name) for name in names]
        slides.append(np.array([line.split(",")[:45] for line in lines], float)[:, places])
        material, repetition, _ = path.stem.split("_")
        materials.append(material)
        blocks.append((int(repetition) - 1) // 10)
    yield from slid("biotac-finger", slides, materials, blocks)


def icub_slide(data: Path) -> Iterator[Question]:
    """Yield slides of the iCub's skin, in the five published folds."""
    slides, materials, blocks = [], [], []
    for fold in ("test", "val_0", "val_1", "val_2", "val_3"):
        X = np.load(data / f"biotac-slide/compiled_data/icub_{fold}.npy").astype(float)
        slides += list(X.reshape(len(X), 60, -1).transpose(0, 2, 1))
        materials += np.load(data / f"biotac-slide/compiled_data/labels_{fold}.npy").astype(str).tolist()
        blocks += [fold] * len(X)
    yield from slid("icub-skin", slides, materials, blocks)


def slid(sensor: str, slides: list[Array], materials: list[str], blocks: list[Any]) -> Iterator[Question]:
    """Yield a row a slide: mean, deviation, minimum, maximum and mean absolute step; then the first frames alone."""
    measures = [[X.mean(0), X.std(0), X.min(0), X.max(0), np.abs(np.diff(X, axis=0)).mean(0)] for X in slides]
    block, y = np.array(blocks), np.array(materials)
    folds = [(block != one, block == one) for one in np.unique(block)]
    for protocol, X in (
        ("deployable", np.array([np.concatenate(one) for one in measures])),
        ("first-frame", np.array([one[0] for one in slides])),
    ):
        yield Question(sensor, "material", protocol, "block", X, y, folds, 300, boosting=False)


def dealt(groups: list[str]) -> list[tuple[Array, Array]]:
    """Deal groups into five folds, the largest first into the emptiest."""
    names, sizes = np.unique(groups, return_counts=True)
    filled, fold = np.zeros(5, int), {}
    for place in sorted(range(len(names)), key=lambda one: (-sizes[one], names[one])):
        fold[names[place]] = int(filled.argmin())
        filled[filled.argmin()] += sizes[place]
    own = np.array([fold[group] for group in groups])
    return [(own != one, own == one) for one in range(5)]


def models(question: Question, seed: int) -> dict[str, Callable[[], Any]]:
    """Return what makes each model anew."""
    if question.y.dtype.kind == "f":
        found = {
            "ols": LinearRegression,
            "boosting": lambda: HistGradientBoostingRegressor(early_stopping=False, random_state=seed),
        }
        if question.trees:
            forest = {"forest": lambda: RandomForestRegressor(question.trees, random_state=seed, n_jobs=2)}
        else:
            forest = {"extra-trees": lambda: ExtraTreesRegressor(200, min_samples_leaf=2, random_state=seed, n_jobs=2)}
        return found | forest
    return {
        "logistic": lambda: LogisticRegression(solver="newton-cg", tol=1e-8, max_iter=2000),
        "forest": lambda: RandomForestClassifier(question.trees, random_state=seed, n_jobs=2),
        "boosting": lambda: HistGradientBoostingClassifier(early_stopping=False, random_state=seed),
    }


def score(question: Question, predict: Callable[[Array, Array], Array]) -> float:
    """Return RMSE, mean Euclidean error or accuracy over all tested rows; `predict` gets masks of rows."""
    answered = np.ones(len(question.X), bool) if question.answered is None else question.answered
    true, given = [], []
    for train, test in question.folds:
        true.append(question.y[test & answered])
        given.append(predict(train, test))
    y, p = np.concatenate(true), np.concatenate(given)
    if y.dtype.kind != "f":
        return float((y == p).mean())
    return float(np.sqrt(((y - p) ** 2).mean()) if y.ndim == 1 else np.sqrt(((y - p) ** 2).sum(1)).mean())


def learned(question: Question, make: Callable[[], Any], X: Array) -> float:
    """Return the score of a model taught on features that are scaled by the training rows."""
    answered = np.ones(len(X), bool) if question.answered is None else question.answered

    def predict(train: Array, test: Array) -> Array:
        scale = StandardScaler().fit(X[train])
        known, asked = scale.transform(X[train & answered]), scale.transform(X[test & answered])
        y = question.y[train & answered]
        if y.ndim == 1:
            return make().fit(known, y).predict(asked)
        return np.stack([make().fit(known, column).predict(asked) for column in y.T], axis=1)

    return score(question, predict)


def trivial(question: Question) -> float:
    """Return the score of the mean, or of the most frequent class."""
    answered = np.ones(len(question.X), bool) if question.answered is None else question.answered

    def predict(train: Array, test: Array) -> Array:
        y, n = question.y[train & answered], int((test & answered).sum())
        if y.dtype.kind == "f":
            return np.repeat(y.mean(0, keepdims=True), n, axis=0)
        names, counts = np.unique(y, return_counts=True)
        return np.repeat(names[counts.argmax()], n)

    return score(question, predict)


def figures(question: Question) -> Iterator[tuple[str, float]]:
    """Yield estimator and score with seed 1."""
    for name, make in models(question, 1).items():
        if name != "boosting" or question.boosting:
            yield name, learned(question, make, question.X)
    yield "mean" if question.y.dtype.kind == "f" else "majority", trivial(question)
    if question.row is not None:
        yield "time-index", learned(question, LinearRegression, question.row[:, None])


def seeds_range(question: Question, seeds: int) -> str:
    """Return the scores of the forest between which other seeds lie."""
    scores = [learned(question, models(question, seed)["forest"], question.X) for seed in range(2, 2 + seeds)]
    return f"{min(scores):.4f} to {max(scores):.4f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--board", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    given = parser.parse_args()
    rows = json.loads(given.board.read_text()) if given.board else []
    rows = rows["rows"] if isinstance(rows, dict) else rows
    board = {
        (*(row[name] for name in ("sensor", "task", "protocol", "split")), row["estimator"].partition("-1")[0]):
        row["score"] for row in rows
    }  # fmt: skip
    print("| sensor | task | protocol | split | estimator | board | plain script | difference | other seeds |")
    print("|---|---|---|---|---|---|---|---|---|")
    for make in (eflesh_force, eflesh_location, eflesh_slip, biotacsp, icub, fluid, biotac_slide, icub_slide):
        for question in make(given.data):
            for name, found in figures(question):
                words = (question.sensor, question.task, question.protocol, question.split, name)
                there = board.get(words, float("nan"))
                more = seeds_range(question, given.seeds) if name == "forest" and abs(there - found) > 1e-9 else ""
                print(
                    "|",
                    " | ".join((*words, f"{there:.6f}", f"{found:.6f}", f"{there - found:.0e}", more)),
                    "|",
                    flush=True,
                )


if __name__ == "__main__":
    main()

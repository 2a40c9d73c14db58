"""Twenty objects on five data sets: how long they take beside plain ``cross_validate`` in as many processes.

::

    python benchmarks/side_by_side.py [--root FOLDER] [--jobs 2] [--runs 5]

Both begin with recordings, use the same folds and end with scores; `run` also answers the trivial estimators, computes
intervals and stores every answer.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import joblib
from sklearn.base import BaseEstimator
from sklearn.ensemble import ExtraTreesRegressor, HistGradientBoostingRegressor, RandomForestRegressor
from sklearn.linear_model import Ridge
from sklearn.model_selection import cross_validate
from sklearn.neighbors import KNeighborsRegressor

import tactbench

DATA = {
    "eflesh-normal": "force", "eflesh-normal-raw": "force", "eflesh-shear": "shear-force",
    "eflesh-shear-raw": "shear-force", "fluid-force": "force",
}  # fmt: skip
SCORING = "neg_root_mean_squared_error"


def objects() -> dict[str, BaseEstimator]:
    """Return twenty regressors of five families."""
    made = {f"ridge {alpha:g}": Ridge(alpha) for alpha in (0.01, 0.1, 1.0, 10.0)}
    made |= {f"neighbours {k}": KNeighborsRegressor(k) for k in (1, 3, 5, 9)}
    made |= {f"forest {n}": RandomForestRegressor(n, random_state=0) for n in (20, 40, 60, 80)}
    made |= {f"extra trees {n}": ExtraTreesRegressor(n, random_state=0) for n in (20, 40, 60, 80)}
    return made | {f"boosting {n}": HistGradientBoostingRegressor(max_iter=n, random_state=0) for n in (20, 40, 60, 80)}


def plain(data: dict[str, list], jobs: int) -> dict[tuple[str, str], float]:
    """Return the mean score over folds of each object on the recordings of each sensor."""
    asked = []
    for name, recordings in data.items():
        for sensor in dict.fromkeys(one.sensor.name for one in recordings):
            read = tactbench.load_task(DATA[name], [one for one in recordings if one.sensor.name == sensor])
            X, y, folds = read.X, read.y, read.folds
            asked += [(sensor, called, X, y, folds, model) for called, model in objects().items()]
    calls = (joblib.delayed(cross_validate)(model, X, y, cv=folds, scoring=SCORING) for *_, X, y, folds, model in asked)
    scores = joblib.Parallel(jobs)(calls)
    return {one[:2]: -found["test_score"].mean() for one, found in zip(asked, scores, strict=True)}


def main() -> None:
    """Print both times, their ratio, and the largest difference of a score of a fold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=Path, help="a folder of copies of the data sets")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--runs", type=int, default=5)
    given = parser.parse_args()
    data = {name: tactbench.dataset(name, root=given.root) for name in DATA}
    ratios = []
    for _ in range(given.runs):
        began = time.perf_counter()
        scores = plain(data, given.jobs)
        middle = time.perf_counter()
        with tempfile.TemporaryDirectory() as out:
            table = tactbench.run(data=data, estimators=objects(), tasks=DATA, jobs=given.jobs, out=out)
        ours_s, plain_s = time.perf_counter() - middle, middle - began
        ratios.append(ours_s / plain_s)
        print(f"plain {plain_s:.1f} s, run {ours_s:.1f} s: {ratios[-1]:.2f}x")
    apart = {}
    for row in table:
        if (row["sensor"], row["estimator"]) in scores:
            folds = [row["scores"][name] for name in row["fold_sizes"]]
            ratio = statistics.mean(folds) / scores[row["sensor"], row["estimator"]]
            family = row["estimator"].rsplit(" ", 1)[0]
            apart[family] = max(apart.get(family, 0.0), abs(ratio - 1))
    print(f"median {statistics.median(ratios):.2f}x; scores differ by", {k: f"{v:.2g}" for k, v in apart.items()})


if __name__ == "__main__":
    main()

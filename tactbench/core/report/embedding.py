"""A test set in two dimensions: t-SNE of the features an estimator saw, computed once and stored."""

from __future__ import annotations

import hashlib
import importlib
import json
import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tactbench.core.errors import DataError, NotApplicable
from tactbench.core.evaluation.cell import load_task
from tactbench.core.evaluation.fitting import features_of
from tactbench.core.evaluation.sets import prepared
from tactbench.core.files import replace_file
from tactbench.core.provenance.source import versions
from tactbench.core.report.results import Results
from tactbench.core.samples import Answers, FloatArray, IntArray

FOLDER = "report"
"""Inside a result folder."""


def stored(results: Path, kind: str, facts: Mapping[str, Any], compute: Callable[[], Mapping[str, Any]]) -> Any:
    """Return what `compute` returns, from disk if it was computed for the same `facts` before.

    Parameters
    ----------
    results
        The result folder; the file is ``report/KIND/DIGEST.json`` in it.
    kind
        What is stored: the name of a folder.
    facts
        Everything that decides the numbers, fit for JSON. Any other fact, any other file.
    compute
        Returns numbers, strings, lists and mappings; floats are read back exactly.

    Notes
    -----
    A file that is damaged is made anew, and a folder that cannot be written costs the next reader the time, no more.
    """
    key_text = json.dumps(facts, sort_keys=True)
    path = results / FOLDER / kind / f"{hashlib.sha256(key_text.encode()).hexdigest()[:32]}.json"
    try:
        found = json.loads(path.read_bytes())
        if found["facts"] == json.loads(key_text):
            return found["numbers"]
    except (OSError, ValueError, KeyError, TypeError):
        pass
    numbers = compute()
    text = json.dumps({"facts": facts, "numbers": numbers}, sort_keys=True, allow_nan=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, f"{text}\n".encode())
    except OSError:
        pass
    return json.loads(text)["numbers"]


AT_MOST = 1000
"""Points of an embedding: more take longer and hide each other in a column's width."""
PERPLEXITY = 30.0
ITERATIONS = 1000
_RULE = f"every n-th row of the test set, n the smallest that leaves at most {AT_MOST}"


@dataclass(frozen=True)
class Embedding:
    """Points in the plane, and the test rows they stand for."""

    xy: FloatArray
    """(points, 2), in no unit"""
    rows: IntArray
    """(points,) places in the test set's answers"""
    every: int
    perplexity: float
    divergence: float
    """Kullback-Leibler divergence that is left, nats"""


def embed(results: Results, row: Mapping[str, Any], test: Answers) -> Embedding:
    """Return the t-SNE of a cell's test set [1]_, from the result folder if it has been computed before.

    Parameters
    ----------
    results
        Where the recordings and the stored embeddings are.
    row
        The cell.
    test
        What it answered on the test set.

    Raises
    ------
    NotApplicable
        If the test set is in several folds, each with features of its own, or too small.
    DataError
        If the recordings are not those the cell was answered from.

    Notes
    -----
    The stored numbers go by the cell's key, which covers the content of the recordings, task, protocol, split, seed,
    sources and versions; by the rule, the perplexity and the number of iterations. Computed on one thread, since the
    order of summation decides the last bits and t-SNE is chaotic.

    References
    ----------
    .. [1] van der Maaten and Hinton 2008, Visualizing data using t-SNE.
    """
    if np.ptp(test.fold):
        raise NotApplicable(f"split {row['split']!r} has a test set a fold, and no two are scaled alike")
    rows = every_nth(len(test))
    perplexity = min(PERPLEXITY, (len(rows) - 1) / 3)
    if perplexity < 1:
        raise NotApplicable(f"{len(rows)} test rows have no neighbourhoods")
    facts = {
        "cell": row["key"], "rule": _RULE, "points": len(rows), "perplexity": perplexity, "iterations": ITERATIONS,
        "versions": versions(),
    }  # fmt: skip

    def compute() -> dict[str, Any]:
        X = _features(results, row, test)[rows]
        xy, divergence = _tsne(X, perplexity, int(row["seed"]))
        return {"xy": xy.tolist(), "divergence": divergence}

    numbers = stored(results.store.folder, "embeddings", facts, compute)
    every = int(rows[1] - rows[0])
    return Embedding(np.array(numbers["xy"], dtype=np.float64), rows, every, perplexity, numbers["divergence"])


def every_nth(n: int) -> IntArray:
    """Return every m-th of `n` places, m the smallest that leaves at most :data:`AT_MOST`."""
    return np.arange(0, n, max(1, math.ceil(n / AT_MOST)), dtype=np.int64)


def _features(results: Results, row: Mapping[str, Any], test: Answers) -> FloatArray:
    """Return (n, features) of the test set as the estimator saw them: kept, scaled and filtered by the protocol."""
    task = results.registry.tasks[row["task"]].spec
    estimator = results.registry.estimators[row["estimator"]]
    paths = results.recordings(row)
    data = load_task(task, paths, row["protocol"], row["split"], estimator=estimator, seed=row["seed"])
    if data.data.vote:
        raise NotApplicable("a recording is answered by its frames, and has no features of its own")
    k = int(row["chosen"].get("k", estimator.window_grid[0]))
    test_part = prepared(data.assignments[0], data.data, data.rules, k, Counter()).test
    if not (np.array_equal(test_part.recording, test.recording) and np.array_equal(test_part.row, test.row)):
        raise DataError(
            f"The recordings of {row['cell']} give other test rows than were answered.", hint="Run it again."
        )
    return features_of(test_part, estimator)


def _tsne(X: FloatArray, perplexity: float, seed: int) -> tuple[FloatArray, float]:
    manifold = importlib.import_module("sklearn.manifold")
    threads = importlib.import_module("threadpoolctl")
    model = manifold.TSNE(
        perplexity=perplexity, max_iter=ITERATIONS, init="pca", learning_rate="auto", random_state=seed, n_jobs=1
    )
    with threads.threadpool_limits(limits=1):
        xy = model.fit_transform(X)
    return np.asarray(xy, dtype=np.float64), float(model.kl_divergence_)

"""Checks of an estimator, on synthetic data for which the answers are known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.evaluation.fitting import answers, fit

Answer = Callable[[Any], Any]

ROWS, NEW_ROWS, FEATURES, CLASSES, SEED = 400, 40, 7, 3, 1
FEW_ROWS = 40  # of few shots: a protocol that teaches a handful of presses gives no more
LEVEL = 5.0  # mean of the answers: forces do not lie about 0
BETTER = 0.9  # of the trivial answer's error: the question is linear with a tenth of noise, and ours are at half
SAME_ROW = 1e-6  # relative difference between a row by itself and among others: sums of another order


def question(kind: str) -> list[Any]:
    """Return read-only X, y, new X and new y: y is linear in some features, most in the last; one is constant."""
    rng = np.random.default_rng(0)
    X = rng.normal(size=(ROWS + NEW_ROWS, FEATURES))
    y = LEVEL + X @ np.array([0.5, 0.0, 0.0, 0.0, 0.0, -1.0, 2.0]) + 0.2 * rng.normal(size=len(X))
    X[:, 3] = 7.0  # a dead taxel
    if kind == "classification":
        y = np.digitize(y, (LEVEL - 1.0, LEVEL + 1.0)).astype(np.int64)
    if kind == "events":  # which frames hold one
        y = (y > LEVEL).astype(np.int64)
    X.flags.writeable = y.flags.writeable = False
    return [X[:ROWS], y[:ROWS], X[ROWS:], y[ROWS:]]


def _taught(subject: Subject, kind: str, params: Any = None, place: str = "", *, given: Any = None) -> Answer:
    """Fit as an evaluation does, with the rehearsal's parameters by default; return a checked `predict`."""
    X, y, *_ = given or question(kind)
    params = {**subject.descriptor.params, **((subject.descriptor.rehearsal or {}) if params is None else params)}
    with code_of(f"{place}where", subject):
        model = subject.code("where")(kind=kind, seed=SEED, threads=1, **params)
    with code_of(f"{place}fit", subject):
        fit(model, X, y, subject.name, Counter())

    def answer(rows: Any) -> Any:
        with code_of("predict", subject):
            return answers(model, rows, subject.name, CLASSES if kind == "classification" else 0)

    return answer


@check("estimator", needs="code-names-resolve")
def answers_have_the_shape(subject: Subject) -> None:
    """Each row must get one finite answer, even if a column is constant, and no array may change, as others use it too.

    Return an array of shape (n,) from predict: numbers, or the classes of y; leave a constant column out, or divide by
    1; copy before changing: ``X = X.copy()``, no ``-=`` on X or y. Give candidates of the type that a parameter needs:
    5, not 5.0, for a number of neighbours.
    """
    descriptor = subject.descriptor
    for kind in descriptor.kinds:
        _taught(subject, kind)(question(kind)[2])
        _taught(subject, kind, given=[one[:FEW_ROWS] for one in question(kind)], place=f"{FEW_ROWS} rows: ")
    for name, candidates in descriptor.grid.items():
        for one in candidates:
            params = {**(descriptor.rehearsal or {}), name: one}
            _taught(subject, descriptor.kinds[0], params, f"grid[{name}] = {one!r}: ")


@check("estimator", needs="answers-have-the-shape")
def seed_and_data_decide(subject: Subject) -> None:
    """Randomness must come from the seed only, folds must be independent, and in use, rows arrive one by one.

    Pass `seed` on as random_state, return a new object from each call of the factory, and let fit() begin anew. Take
    means, scales and neighbours from fit(), never from the X of predict().
    """
    for kind in subject.descriptor.kinds:
        X, y, new, _ = question(kind)
        answer = _taught(subject, kind)
        together = answer(new)
        one_by_one = np.concatenate([answer(new[place : place + 1]) for place in range(5)])
        drawn = subject.descriptor.looks_at == "nothing"
        if not drawn and not np.allclose(one_by_one, together[:5], rtol=SAME_ROW, atol=SAME_ROW):
            fail("predict", "the answer to a single row differs from its answer among other rows")
        _taught(subject, kind, given=(-X, y[::-1].copy()))
        if not np.array_equal(_taught(subject, kind)(new), together):
            fail("where: argument seed", f"two {kind} models with the same seed and data answer differently")


@check("estimator", needs="seed-and-data-decide")
def it_learns(subject: Subject) -> None:
    """A linear question must be answered better than by the mean; otherwise rows, columns or signs are mixed up.

    Check the order of rows, scaling and signs; set baseline=True where a trivial answer is meant.
    """
    if subject.descriptor.baseline or subject.descriptor.looks_at != "features":
        skip("the estimator is declared as a baseline")
    for kind in subject.descriptor.kinds:
        _, y, new, truth = question(kind)
        given = _taught(subject, kind, {})(new)
        if kind == "events":  # scores, the higher the surer
            given = given > np.median(given)
        error, bar = (float(np.abs(one - truth).mean()) for one in (given, np.median(y)))
        if not error < BETTER * bar or (kind == "regression" and np.array_equal(given, np.round(given))):
            text = f"{kind}: the error is {error:.3g}, that of the mean {bar:.3g}; or answers are rounded"
            fail("predict", text)

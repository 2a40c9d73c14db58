"""Checks of an estimator, on a made-up question with a known answer."""

from __future__ import annotations

import inspect
from collections import Counter
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, CheckSkipped, check, code_of, fail, skip
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import NotApplicable, PluginContractError

if TYPE_CHECKING:
    import numpy.typing as npt

    from tactbench.core.plugins.interfaces import Estimator
    from tactbench.core.samples import FloatArray

ROWS, NEW_ROWS, FEATURES, CLASSES = 90, 30, 4, 3
SEED = 1
BETTER = 0.9
"""Of the error of the mean (or of the commonest class), that an answer which uses the features stays below: the
question is linear with a tenth of noise, so that the worst of ours is at half."""
SAME_ROW = 1e-6
"""Relative difference of one row answered alone and among others: sums of another order, and nothing else."""


@lru_cache(maxsize=2)
def question(kind: str) -> tuple[FloatArray, npt.NDArray[Any], FloatArray, npt.NDArray[Any]]:
    """Return X, y, new X and new y of a question that four features answer."""
    import numpy as np

    rng = np.random.default_rng(0)
    X = rng.normal(size=(ROWS + NEW_ROWS, FEATURES))
    truth = X @ np.array([2.0, -1.0, 0.5, 0.0]) + 0.2 * rng.normal(size=len(X))
    y = truth
    if kind == "classification":
        y = np.digitize(truth, np.quantile(truth, [1 / CLASSES, 2 / CLASSES])).astype(np.int64)
    if kind == "events":  # which frames hold one
        y = (truth > np.median(truth)).astype(np.int64)
    return X[:ROWS], y[:ROWS], X[ROWS:], y[ROWS:]


def _quick(subject: Subject) -> dict[str, Any]:
    """Return the parameters of a check: the defaults, with those of the rehearsal in their place."""
    return {**subject.descriptor.params, **(subject.descriptor.rehearsal or {})}


def _built(subject: Subject, kind: str, **params: Any) -> Estimator:
    try:
        with code_of("where", subject.package):
            made: Estimator = subject.code("where")(kind=kind, seed=SEED, threads=1, **{**_quick(subject), **params})
    except CheckFailed as failure:
        if isinstance(failure.__cause__, NotApplicable):
            skip(f"it says: {failure.__cause__.message}")
        raise
    return made


def _fitted(subject: Subject, kind: str, **params: Any) -> Estimator:
    X, y, _, _ = question(kind)
    model = _built(subject, kind, **params)
    with code_of("fit", subject.package):
        _taught(model, X.copy(), y.copy(), subject)
    return model


def _taught(model: Estimator, X: FloatArray, y: npt.NDArray[Any], subject: Subject) -> None:
    """Fit as an evaluation does: warnings are no errors."""
    from tactbench.core.evaluation.fitting import fit

    fit(model, X, y, subject.name, Counter())


@lru_cache(maxsize=4)
def _answers(subject: Subject, kind: str, *, quick: bool = True) -> npt.NDArray[Any]:
    """Return what it answers to the new rows; `quick`: with the parameters of its rehearsal."""
    from tactbench.core.evaluation.fitting import answers

    model = _fitted(subject, kind, **({} if quick else subject.descriptor.params))
    with code_of("predict", subject.package):
        try:
            return answers(model, question(kind)[2].copy(), subject.name, CLASSES if kind == "classification" else 0)
        except PluginContractError as error:
            raise CheckFailed("predict", str(error)) from error


@check("estimator", needs=("code-names-resolve",))
def arguments_are_taken(subject: Subject) -> None:
    """The factory is called with kind, seed, threads and every parameter by name; an unknown one stops a cell.

    Make every name in params, grid and rehearsal an argument of the factory, and put each into params.
    """
    descriptor = subject.descriptor
    signature = inspect.signature(subject.code("where"))
    anything = any(one.kind is one.VAR_KEYWORD for one in signature.parameters.values())
    for field, names in (
        ("where", ("kind", "seed", "threads")), ("params", descriptor.params), ("grid", descriptor.grid),
        ("rehearsal", descriptor.rehearsal or ()),
    ):  # fmt: skip
        for name in names:
            if name not in signature.parameters and not anything:
                fail(f"{field}[{name}]", f"{descriptor.where} has no argument {name!r}")
            if field in ("grid", "rehearsal") and name not in descriptor.params:
                fail(f"{field}[{name}]", "it is not among params, where every name that may be set stands")
    given = {"kind", "seed", "threads", *descriptor.params}
    for name, one in signature.parameters.items():
        missing = one.default is one.empty and one.kind not in (one.VAR_KEYWORD, one.VAR_POSITIONAL)
        if missing and name not in given:
            fail(f"where: argument {name}", "it has no default, and params does not give it")


@check("estimator")
def kinds_are_stated(subject: Subject) -> None:
    """A run asks it for the kinds that it states, and for no other.

    State "regression", "classification" or both in kinds, each once.
    """
    kinds = subject.descriptor.kinds
    if not kinds or len(set(kinds)) < len(kinds):
        fail("kinds", f"{kinds}: at least one is needed, each once")


@check("estimator")
def grids_can_be_searched(subject: Subject) -> None:
    """Validation chooses among candidates: without one there is nothing to choose, and two equal ones cost time.

    Give every parameter in grid different candidates, and window_grid whole numbers from 0.
    """
    descriptor = subject.descriptor
    for name, candidates in descriptor.grid.items():
        if not candidates or len(set(candidates)) < len(candidates):
            fail(f"grid[{name}]", f"{candidates}: at least one is needed, each once")
    if not descriptor.window_grid or min(descriptor.window_grid) < 0:
        fail("window_grid", f"{descriptor.window_grid}: numbers of past samples, 0 or more, are needed")


@check("estimator", needs=("arguments-are-taken", "kinds-are-stated"))
def estimator_builds(subject: Subject) -> None:
    """One is built for every fold and every candidate, long after a run has begun.

    Return an object with fit(X, y) and predict(X); raise NotApplicable where a library is missing.
    """
    for kind in subject.descriptor.kinds:
        model = _built(subject, kind)
        for name in ("fit", "predict"):
            if not callable(getattr(model, name, None)):
                fail("where", f"it returned a {type(model).__name__} without {name}()")


@check("estimator", needs=("estimator-builds", "grids-can-be-searched"))
def candidates_are_accepted(subject: Subject) -> None:
    """A candidate that cannot be fitted shows after minutes, when its turn comes.

    Give candidates that the parameter may have.
    """
    descriptor = subject.descriptor
    if not descriptor.grid:
        skip("it has no parameters to choose")
    kind = descriptor.kinds[0]
    X, y, _, _ = question(kind)
    for name, candidates in descriptor.grid.items():
        for candidate in candidates:
            with code_of(f"grid[{name}] = {candidate}", subject.package):
                _taught(_built(subject, kind, **{name: candidate}), X.copy(), y.copy(), subject)


@check("estimator", needs=("estimator-builds",), level="silver")
def answers_have_the_shape(subject: Subject) -> None:
    """Each row gets one finite answer; for classes, the index of a class that was taught.

    Return an array of shape (n,) from predict: numbers, or the classes of y.
    """
    for kind in subject.descriptor.kinds:
        _answers(subject, kind)


@check("estimator", needs=("answers-have-the-shape",), level="silver")
def data_is_not_changed(subject: Subject) -> None:
    """All estimators of a run are given the same arrays; one that scales them in place changes the others' scores.

    Copy before changing: ``X = X.copy()``; no ``-=`` on X or y.
    """
    import numpy as np

    for kind in subject.descriptor.kinds:
        X, y, new, _ = (one.copy() for one in question(kind))
        before = [one.copy() for one in (X, y, new)]
        model = _built(subject, kind)
        with code_of("fit", subject.package):
            _taught(model, X, y, subject)
        with code_of("predict", subject.package):
            model.predict(new)
        for name, now, old in zip(("fit: X", "fit: y", "predict: X"), (X, y, new), before, strict=True):
            if not np.array_equal(now, old):
                fail(name, "it was changed in place")


@check("estimator", needs=("answers-have-the-shape",), level="silver")
def same_seed_same_answers(subject: Subject) -> None:
    """`rerun` must give the same answers bit for bit: all chance comes from the seed.

    Pass `seed` to everything that draws, as random_state, and use no global generator.
    """
    import numpy as np

    for kind in subject.descriptor.kinds:
        model = _fitted(subject, kind)
        if not np.array_equal(np.asarray(model.predict(question(kind)[2].copy())), _answers(subject, kind)):
            fail("where: argument seed", f"two {kind} models of one seed answer differently")


@check("estimator", needs=("same-seed-same-answers",), level="silver")
def rows_are_answered_alone(subject: Subject) -> None:
    """In use rows come one by one; an answer that depends on the other rows of a test set uses what nobody has.

    Take means, scales and neighbours from fit(), never from the X of predict().
    """
    import numpy as np

    if _draws(subject):
        skip("its answers are drawn")
    for kind in subject.descriptor.kinds:
        new = question(kind)[2]
        model = _fitted(subject, kind)
        together = np.asarray(model.predict(new.copy()))
        with code_of("predict", subject.package):
            alone = np.concatenate([np.asarray(model.predict(new[place : place + 1].copy())) for place in range(5)])
        if not np.allclose(alone, together[:5], rtol=SAME_ROW, atol=SAME_ROW):
            fail("predict", "a row asked alone is answered otherwise than among others")


def _draws(subject: Subject) -> bool:
    """Whether a baseline draws its answers: it looks at nothing and does not answer all rows alike."""
    import numpy as np

    kind = subject.descriptor.kinds[0]
    return subject.descriptor.looks_at == "nothing" and len(np.unique(_answers(subject, kind))) > 1


@check("estimator", needs=("same-seed-same-answers",), level="silver")
def a_new_fit_forgets(subject: Subject) -> None:
    """Folds must not know of each other: a model that keeps what another fold taught it has seen the test set.

    Let each call of the factory return a new object, and let fit() begin anew.
    """
    import numpy as np

    for kind in subject.descriptor.kinds:
        X, y, new, _ = question(kind)
        first, second = _built(subject, kind), _built(subject, kind)
        if first is second:
            fail("where", "it returned the same object twice")
        with code_of("fit", subject.package):
            other = y[::-1].copy()
            _taught(first, -X, other, subject)
            _taught(second, X.copy(), y.copy(), subject)
        if not np.array_equal(np.asarray(second.predict(new.copy())), _answers(subject, kind)):
            fail("fit", "a model answers otherwise once another one was taught something else")


@check("estimator", needs=("same-seed-same-answers",), level="silver")
def it_learns(subject: Subject) -> None:
    """Four features answer a linear question: whoever is no better than the mean mixes rows, columns or signs up.

    Look at the order of rows, at scaling and at signs; set baseline=True where a trivial answer is meant.
    """
    import numpy as np

    descriptor = subject.descriptor
    if descriptor.baseline or descriptor.looks_at != "features":
        skip("it is a trivial answer by its own account")
    for kind in descriptor.kinds:
        _, y, _, truth = question(kind)
        given = _answers(subject, kind, quick=False)
        if kind == "events":  # scores, the higher the surer
            if not given[truth == 1].mean() > given[truth == 0].mean():
                fail("predict", "events: its scores are not higher for frames with one")
            continue
        if kind == "regression":
            error, bar = np.sqrt(np.mean((given - truth) ** 2)), np.sqrt(np.mean((y.mean() - truth) ** 2))
        else:
            error, bar = np.mean(given != truth), np.mean(np.bincount(y).argmax() != truth)
        if error > BETTER * bar:
            fail("predict", f"{kind}: its error is {error:.3g}, that of the trivial answer {bar:.3g}")


@check("estimator", needs=("answers-have-the-shape",), level="silver")
def constant_features_are_borne(subject: Subject) -> None:
    """A dead taxel is a constant column, and a fold may hold one: scaling divides by its deviation, 0.

    Leave such a column out, or divide by 1.
    """
    import numpy as np

    for kind in subject.descriptor.kinds:
        X, y, new, _ = (one.copy() for one in question(kind))
        X[:, 1] = new[:, 1] = 7.0
        model = _built(subject, kind)
        with code_of("fit", subject.package):
            _taught(model, X, y, subject)
        with code_of("predict", subject.package), np.errstate(all="ignore"):
            given = np.asarray(model.predict(new), dtype=np.float64)
        if not np.isfinite(given).all():
            fail("predict", f"{kind}: {np.count_nonzero(~np.isfinite(given))} answers are not finite")


@check("estimator", needs=("answers-have-the-shape",), level="silver")
def linear_is_linear(subject: Subject) -> None:
    """`show` and `cost` tell linear estimators from others by the descriptor's word.

    Set linear=False, or None where it is not known.
    """
    import numpy as np

    descriptor = subject.descriptor
    if not descriptor.linear or "regression" not in descriptor.kinds:
        skip("it does not say that its answers are linear numbers")
    model = _fitted(subject, "regression")
    new = question("regression")[2]
    a, b = new[:10], new[10:20]
    ends = [np.asarray(model.predict(one.copy()), dtype=np.float64) for one in (a, b, (a + b) / 2)]
    if not np.allclose(ends[2], (ends[0] + ends[1]) / 2, rtol=1e-6, atol=1e-6):
        fail("linear", "it is stated, and the answer half-way between two rows is not the mean of theirs")


@check("estimator", may_skip=True)
def distributions_are_known(subject: Subject) -> None:
    """A cell's key covers the versions of the distributions that compute it; a misspelt name covers nothing.

    Name distributions as `pip list` does.
    """
    from importlib import metadata

    names = subject.descriptor.distributions
    if not names:
        skip("it names no distributions of its own")
    known = {(one.name or "").lower().replace("_", "-") for one in metadata.distributions()}
    if not any(name.lower() in known for name in names):
        try:
            _built(subject, subject.descriptor.kinds[0])
        except (CheckFailed, CheckSkipped):
            skip(f"none of {', '.join(names)} is installed")
        fail("distributions", f"none of {', '.join(names)} is installed, and yet it can be built")


CHECKS = (
    kinds_are_stated, arguments_are_taken, grids_can_be_searched, distributions_are_known, estimator_builds,
    candidates_are_accepted, answers_have_the_shape, data_is_not_changed, same_seed_same_answers,
    rows_are_answered_alone, a_new_fit_forgets, it_learns, constant_features_are_borne, linear_is_linear,
)  # fmt: skip

"""Splits: divide rows into training, validation and test sets, such that these share no group (session, object …)."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError, NotApplicable, UsageError
from tactbench.core.evaluation.dataset import Dataset, Mask
from tactbench.core.evaluation.protocols import FIRST_FRAME, ProtocolSpec, shots
from tactbench.core.samples import FloatArray
from tactbench.core.spec.row import LEAKS
from tactbench.core.spec.task import TaskSpec

Places = npt.NDArray[np.int64]
FOLDS = 5
"""Number of folds of grouped and shuffled splits."""
TRAIN_SHARE = 0.8
"""Share of a recording's labelled rows, from its start, on which an in-session split trains."""
SPLITS_WITHOUT_GROUPS = ("roles", "session", "in-session", "shuffled")
"""Splits whose unit of replication is the session, as it also is for few-shot-N."""
ONE_BY_ONE = ("unit", "placement", "cap_radius_mm")
"""Kinds of groups of which each is a fold of its own for any task; a task's campaigns may add other kinds."""
MOST_ONE_BY_ONE = 12
"""Largest number of groups that are each a fold of their own; more groups are divided into `FOLDS` folds."""
SHUFFLED_STAMP = f"{LEAKS}split shuffled puts neighbouring rows of one recording or object on both sides."
SHUFFLED_WHOLE_STAMP = f"{LEAKS}split shuffled deals recordings at random, of one object or session on both sides."


@dataclass(frozen=True)
class Assignment:
    """One fold: masks of its training, test and validation rows over the rows of all recordings in order."""

    name: str
    train: Mask
    test: Mask
    validation: Mask | None = None
    groups: str = "session"
    """Name of the group labels that training and test rows do not share; an inner split keeps them apart too."""


class OwnSplit:
    """Folds given by a caller: an object with scikit-learn's ``split(X, y, groups)``, or pairs of index arrays.

    The folds are made once and reused, so that all estimators are scored on the same folds even by a random object.
    """

    def __init__(self, split: Any, groups: str | npt.ArrayLike | None) -> None:
        self.groups = groups
        self._splitter = split if hasattr(split, "split") else list(split)
        self._folds: list[tuple[Places, Places]] = []

    @property
    def name(self) -> str:
        """Name of the split in results and tables."""
        if isinstance(self._splitter, list):
            return f"{len(self._splitter)} given folds"
        return " ".join(repr(self._splitter).partition(" object at 0x")[0].split())

    def folds(self, X: FloatArray, y: npt.NDArray[Any], groups: npt.NDArray[Any] | None) -> list[tuple[Places, Places]]:
        """Return (training, test) indices of rows of X for each fold; raise UsageError if there are none."""
        if not self._folds:
            given: Any = self._splitter
            try:
                with warnings.catch_warnings():  # such groups are the units of intervals
                    warnings.filterwarnings("ignore", "The groups parameter is ignored")
                    pairs = given if isinstance(given, list) else list(given.split(X, y, groups))
                self._folds = [(_places(train, len(y)), _places(test, len(y))) for train, test in pairs]
                if not self._folds:
                    raise ValueError("no fold was given.")
            except (TypeError, ValueError, IndexError) as error:
                raise UsageError(
                    f"split={self.name} makes no folds of {len(y)} rows: {error}",
                    hint="`split` takes a name, an object with scikit-learn's `split(X, y, groups)`, or pairs of index "
                    "arrays (train, test) over the rows of X; `groups` takes the groups for such an object.",
                ) from error
        return self._folds


def _places(given: Any, n: int) -> Places:
    """Return row indices given as indices or as a mask over n rows; raise ValueError or IndexError for other values."""
    found: Places = np.arange(n)[np.asarray(given)]
    if len(np.unique(found)) < found.size:
        raise ValueError("an index array contains a row twice.")
    return found


def choose_split(task: TaskSpec, protocol: ProtocolSpec, data: Dataset, requested: str | None) -> str:
    """Return the name of the split to use: the requested split, or the task's first split that is possible.

    Raises UsageError if the recordings cannot be split as requested, NotApplicable if the protocol does not allow the
    requested split or no split of the task is possible.
    """
    if protocol.roles_only:
        if requested not in (None, "roles"):
            raise NotApplicable(
                f"Protocol {protocol.name!r} splits by roles only, not by {requested!r}.",
                hint="Use protocol `deployable` for other splits.",
            )
        if not {"train", "validation", "test"} <= {meta.role for meta in data.metas}:
            raise NotApplicable(
                f"Protocol {protocol.name!r} needs recordings with the roles train, validation and test; these have "
                f"{', '.join(sorted({meta.role or 'no role' for meta in data.metas}))}.",
                hint="Use protocol `deployable`.",
            )
        return "roles"
    if requested == "in-session" and data.whole:
        raise NotApplicable(
            f"Split 'in-session' cuts recordings in time, but task {task.name!r} needs whole recordings.",
            hint="Use a split that keeps recordings whole, such as `recording`.",
        )
    if requested is not None:
        if not _can(requested, data):
            names = {name for table in data.tables for name in table.groups} | {"roles", "in-session", "shuffled"}
            names |= {name for name in task.splits if shots(name)}
            able = sorted(name for name in names if _can(name, data))
            raise UsageError(
                f"These recordings cannot be split by {requested!r}.", hint=f"Choose one of: {', '.join(able)}."
            )
        return requested
    for name in sorted(task.splits, key=lambda name: name == "shuffled"):  # a leak is better than no answer only
        if _can(name, data):
            return name
    raise NotApplicable(
        f"None of the splits of task {task.name!r} ({', '.join(task.splits)}) is possible with these recordings.",
        hint="State sessions, roles or group labels in the mapping, or choose another split.",
    )


def require_first_rows(task: TaskSpec, data: Dataset, split: str) -> None:
    """Raise NotApplicable if a protocol on the first rows of recordings cannot test them for leaks."""
    changing = next((one.meta.name for one in data.tables if len(np.unique(one.y[one.labelled], axis=0)) > 1), None)
    alone = all(len(table.row) == 1 for table in data.tables)
    if changing is not None:
        why = f"the answer of task {task.name!r} changes within recording {changing!r}"
    elif split == "in-session" or alone or not any(table.labelled[:1].any() for table in data.tables):
        why = "the test set has no first row of a longer recording"
    else:
        return
    raise NotApplicable(
        f"Protocol {FIRST_FRAME.name!r} cannot test if a recording's first row alone tells the answer: {why}.",
        hint="Compare with split `shuffled` instead, or use a split that keeps recordings whole.",
    )


def _can(name: str, data: Dataset) -> bool:
    if name == "roles":
        return {"train", "test"} <= {meta.role for meta in data.metas}
    if name == "shuffled":
        return not data.whole or len(_open_to_folds(data)) > 1
    if name == "in-session":
        return not data.whole
    number = shots(name)
    if number is not None:
        return len(training_sessions(data)) >= number and any(meta.role == "test" for meta in data.metas)
    # Rows of no known group could be related to either side.
    known = all(name in data.tables[place].groups for place in _open_to_folds(data))
    return known and len(_sizes(data, _open_rows(data), name)) >= 2


def training_sessions(data: Dataset) -> list[str]:
    """Return the names of the sessions to train on, in the order in which few-shot splits use them.

    These sessions have recordings of role train and none of role test; numbers in names are ordered as numbers.
    """
    tested = {meta.session for meta in data.metas if meta.role == "test"}
    found = {meta.session for meta in data.metas if meta.role == "train"} - tested
    # Every second part of a name is a number.
    return sorted(found, key=lambda name: [int(part) if place % 2 else part
                                           for place, part in enumerate(re.split(r"([0-9]+)", name))])  # fmt: skip


def make_splits(data: Dataset, split: str, seed: int, gap: int = 0, *, one_by_one: bool = False) -> list[Assignment]:
    """Return the folds, masks of training, test and validation rows, of the split called `split`.

    Parameters
    ----------
    one_by_one
        True to make each group a fold of its own, as with `ONE_BY_ONE`, in place of folds of several groups, if there
        are at most `MOST_ONE_BY_ONE` groups.
    gap
        Rows left out between training and test where a recording is cut in time: those of the longest mean filter.

    Notes
    -----
    Recordings of role ``test`` are used only by split ``roles`` and few-shot splits, or if there are no others.
    """
    number = shots(split)
    if split == "roles" or number is not None:
        return [_by_roles(data, number, split)]
    if split == "in-session":
        return list(_in_session(data, gap))
    if split == "shuffled":
        return list(_shuffled(data, seed))
    sizes = _sizes(data, _open_rows(data), split)
    names = sorted(sizes)
    if split == "session":
        return [_held_out(data, split, {name}, name) for name in names]
    if (one_by_one or split in ONE_BY_ONE) and len(names) <= MOST_ONE_BY_ONE:
        return [_held_out(data, split, {name}, f"{split} {name}") for name in names]
    return [_held_out(data, split, values, f"{split} fold {number}") for number, values in enumerate(_dealt(sizes), 1)]


def _open_to_folds(data: Dataset) -> list[int]:
    """Return indices of the recordings for cross-validation: those not of role test, or all if there are no others."""
    free = [place for place, meta in enumerate(data.metas) if meta.role != "test"]
    return free or list(range(len(data.tables)))


def _open_rows(data: Dataset) -> Mask:
    """Return a mask of the rows of the recordings for cross-validation."""
    return np.isin(data.recording, _open_to_folds(data))


def _by_roles(data: Dataset, number: int | None, name: str) -> Assignment:
    """Return the fold given by roles; with a `number`, train on that many sessions only, without validation rows."""
    train, validation, test = (
        data.column(lambda table: table.meta.role == role)  # noqa: B023
        for role in ("train", "validation", "test")
    )
    if number is not None:
        train = np.isin(data.column(lambda table: table.meta.session), training_sessions(data)[:number])
    return Assignment(name, train, test, validation if validation.any() and number is None else None)


def _in_session(data: Dataset, gap: int) -> Iterator[Assignment]:
    """Yield one fold for each session: train on the first part of each of its recordings, test on the rest."""
    opened, session = _open_rows(data), data.column(lambda table: table.meta.session)
    for name in np.unique(session[opened]).tolist():
        train, test = _cut_in_time(data, opened & (session == name), gap, fewest=10)
        if test.any():
            yield Assignment(name, train, test)


def _cut_in_time(data: Dataset, rows: Mask, gap: int, fewest: int) -> tuple[Mask, Mask]:
    """Return masks of each recording's first and last part, with a gap between; both empty below `fewest` labels."""
    before, after = [], []
    for table, mask in zip(data.tables, data.parted(rows), strict=True):
        labelled, number = np.flatnonzero(mask & table.labelled), np.arange(len(table.row))
        enough = len(labelled) >= fewest
        first = labelled[int(TRAIN_SHARE * len(labelled))] if enough else len(number)
        before.append(mask & (number < first - gap) & enough)
        after.append(mask & (number >= first))
    return np.concatenate(before), np.concatenate(after)


def _dealt(sizes: Mapping[str, int]) -> list[set[str]]:
    """Divide groups into folds of about equal size: the largest first, each into the smallest fold, ties by name.

    The result depends neither on chance nor on the order of files; scikit-learn's ``GroupKFold`` breaks ties otherwise.
    """
    folds: list[set[str]] = [set() for _ in range(min(FOLDS, len(sizes)))]
    filled = [0] * len(folds)
    for value in sorted(sizes, key=lambda name: (-sizes[name], name)):
        smallest = filled.index(min(filled))
        folds[smallest].add(value)
        filled[smallest] += sizes[value]
    return folds


def _held_out(data: Dataset, group: str, values: set[str], name: str) -> Assignment:
    opened, held_out = _open_rows(data), np.isin(_labels(data, group), sorted(values))
    return Assignment(name, opened & ~held_out, opened & held_out, groups=group)


def _labels(data: Dataset, group: str) -> npt.NDArray[Any]:
    """Return the (rows,) group labels called `group`; empty texts for recordings without such labels."""
    return data.column(lambda table: table.groups.get(group, ""))


def _shuffled(data: Dataset, seed: int) -> Iterator[Assignment]:
    """Yield folds of random rows; for tasks on whole recordings, of random recordings with about equal classes."""
    rng = np.random.default_rng(seed)
    places, folds = _open_to_folds(data), FOLDS
    if data.whole:
        order = [int(place) for place in rng.permutation(places) if data.tables[place].labelled.any()]
        if data.classes:
            order.sort(key=lambda place: int(data.tables[place].y[data.tables[place].labelled][0]))
        folds = min(FOLDS, len(order))
        dealt: dict[int, Any] = {place: at % folds for at, place in enumerate(order)}
    else:
        dealt = {place: rng.permutation(np.arange(len(data.tables[place].row)) % FOLDS) for place in places}
    number = np.concatenate([np.broadcast_to(dealt.get(place, -1), len(table.row))
                             for place, table in enumerate(data.tables)])  # fmt: skip
    for fold in range(folds):
        test = number == fold
        yield Assignment(f"shuffled fold {fold + 1}", (number >= 0) & ~test, test, groups="recording")


def inner_splits(data: Dataset, outer: Assignment, gap: int = 0) -> list[tuple[Mask, Mask]]:
    """Divide the training rows of `outer` into (train, validation) masks, for choosing hyper-parameters.

    The groups that the outer split keeps apart are kept apart here too: each group validates once, in at most five
    folds. With a single group, the last fifth of each recording validates; for tasks on whole recordings, the
    recordings are then the groups.
    """
    groups, sizes = outer.groups, _sizes(data, outer.train, outer.groups)
    if data.whole and len(sizes) < 2:
        groups, sizes = "recording", _sizes(data, outer.train, "recording")
    if len(sizes) < 2:
        return [_cut_in_time(data, outer.train, gap, fewest=5)]
    held_out = [np.isin(_labels(data, groups), sorted(values)) for values in _dealt(sizes)]
    return [(outer.train & ~out, outer.train & out) for out in held_out]


def with_validation(outer: Assignment, data: Dataset) -> Assignment:
    """Return a fold whose training rows are divided into rows for fitting and rows for choosing a threshold.

    The latter are the validation rows of as many inner splits as needed to include events and disturbances, if any.
    """
    y, disturbance = data.column(lambda table: table.y), data.column(lambda table: table.slip.disturbance)

    def classes(rows: Mask) -> set[int]:
        return set(y[rows & data.labelled].tolist())

    check = np.zeros_like(outer.train)
    for _, more in inner_splits(data, outer):
        check = check | more
        learn = outer.train & ~check
        kinds = [(classes(rows), set(disturbance[rows].tolist())) for rows in (check, outer.train)]
        if kinds[0] == kinds[1]:
            if classes(learn) == classes(outer.train):
                return replace(outer, train=learn, validation=check)
            break
    raise DataError(
        f"The training recordings of fold {outer.name!r} cannot be divided into recordings for fitting and recordings "
        "for choosing the threshold, each with events.",
        hint="Add training recordings with events, or recordings of the role validation.",
    )


def _sizes(data: Dataset, rows: Mask, group: str) -> dict[str, int]:
    """Return the number of labelled rows in each group, among the rows in a mask."""
    values, counts = np.unique(_labels(data, group)[rows & data.labelled], return_counts=True)
    return dict(zip(values.tolist(), counts.tolist(), strict=True))


def over_rows(assignment: Assignment, made: Dataset, recorded: Dataset) -> Assignment:
    """Return a fold of derived rows (windows, frames, whole recordings) as masks over all recorded rows.

    For windows, their last rows are marked; for frames and whole recordings, all rows of the recording.
    """

    def spread(rows: Mask) -> Mask:
        return np.concatenate([
            np.isin(table.row, own.row[mask]) if own.X.ndim > 2
            else mask if len(mask) == len(table.row) else np.full(len(table.row), bool(mask[0]))
            for mask, own, table in zip(made.parted(rows), made.tables, recorded.tables, strict=True)
        ])  # fmt: skip

    validation = None if assignment.validation is None else spread(assignment.validation)
    return replace(assignment, train=spread(assignment.train), test=spread(assignment.test), validation=validation)

"""Splits: which rows train, validate and test, and the groups that these do not share."""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
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
"""Folds of grouped and of shuffled splits."""
TRAIN_SHARE = 0.8
"""First part, in time, that an in-session split trains on."""
SPLITS_WITHOUT_GROUPS = ("roles", "session", "in-session", "shuffled")
"""Splits whose unit of replication is the session; few-shot-N is another."""
ONE_BY_ONE = ("unit", "placement", "cap_radius_mm")
"""Groups that are left out one by one whatever the task, beside those of the task's own campaigns."""
MOST_ONE_BY_ONE = 12
"""Up to so many groups are left out one by one; more are dealt into folds."""
SHUFFLED_STAMP = f"{LEAKS}split shuffled puts neighbouring rows of one recording or object on both sides."
SHUFFLED_WHOLE_STAMP = f"{LEAKS}split shuffled deals recordings at random, of one object or session on both sides."


@dataclass(frozen=True)
class Assignment:
    """The rows that train, test and validate: masks over the rows of all recordings, one after the other."""

    name: str
    train: Mask
    test: Mask
    validation: Mask | None = None
    groups: str = "session"
    """Name of the groups that training and test do not share; also those of an inner split."""


class OwnSplit:
    """Folds that a caller gives: by an object with scikit-learn's ``split(X, y, groups)``, or as index arrays.

    They are made once, so that all that is scored by them has the same, whatever the object draws.
    """

    def __init__(self, split: Any, groups: str | npt.ArrayLike | None) -> None:
        self.groups = groups
        self._splitter = split if hasattr(split, "split") else list(split)
        self._folds: list[tuple[Places, Places]] = []

    @property
    def name(self) -> str:
        """The name in rows and tables."""
        if isinstance(self._splitter, list):
            return f"{len(self._splitter)} given folds"
        return " ".join(repr(self._splitter).partition(" object at 0x")[0].split())

    def folds(self, X: FloatArray, y: npt.NDArray[Any], groups: npt.NDArray[Any] | None) -> list[tuple[Places, Places]]:
        """Return the rows of X that train and those that test, fold by fold; UsageError if they are none."""
        if not self._folds:
            given: Any = self._splitter
            try:
                with warnings.catch_warnings():  # such groups are the units of intervals
                    warnings.filterwarnings("ignore", "The groups parameter is ignored")
                    pairs = given if isinstance(given, list) else list(given.split(X, y, groups))
                self._folds = [(_places(train, len(y)), _places(test, len(y))) for train, test in pairs]
                if not self._folds:
                    raise ValueError("there is none.")
            except (TypeError, ValueError, IndexError) as error:
                raise UsageError(
                    f"split={self.name} makes no folds of {len(y)} rows: {error}",
                    hint="`split` takes a name, an object with scikit-learn's `split(X, y, groups)`, or pairs of index "
                    "arrays (train, test) over the rows of X; what a splitter keeps apart is given as `groups`.",
                ) from error
        return self._folds


def _places(given: Any, n: int) -> Places:
    """Return the places of rows, given as such or as a mask; ValueError or IndexError for anything else."""
    found: Places = np.arange(n)[np.asarray(given)]
    if len(np.unique(found)) < found.size:
        raise ValueError("a row stands twice in one index array.")
    return found


def choose_split(task: TaskSpec, protocol: ProtocolSpec, data: Dataset, requested: str | None) -> str:
    """Return the split to use: the one that was requested, or the task's first that the recordings can serve.

    Raises UsageError if the requested one cannot be served, NotApplicable if it does not go with the protocol or none
    of the task's can be served.
    """
    split = _split_for(task, protocol, data, requested)
    if protocol.first_row_only:
        _require_first_rows(task, data, split)
    return split


def _split_for(task: TaskSpec, protocol: ProtocolSpec, data: Dataset, requested: str | None) -> str:
    if protocol.roles_only:
        if requested not in (None, "roles"):
            raise NotApplicable(
                f"Protocol {protocol.name!r} splits by roles only; {requested!r} was asked for.",
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
            f"Split 'in-session' cuts recordings in time; task {task.name!r} asks one answer of each as a whole.",
            hint="Use a split that keeps recordings whole, such as `recording`.",
        )
    if requested is not None:
        if not _can(requested, data):
            names = {name for table in data.tables for name in table.groups} | {"roles", "in-session", "shuffled"}
            names |= {name for name in task.splits if shots(name)}
            able = sorted(name for name in names if _can(name, data))
            raise UsageError(
                f"These recordings cannot be split by {requested!r}.", hint=f"They can by: {', '.join(able)}."
            )
        return requested
    for name in sorted(task.splits, key=lambda name: name == "shuffled"):  # a leak is better than no answer only
        if _can(name, data):
            return name
    raise NotApplicable(
        f"None of the splits of task {task.name!r} ({', '.join(task.splits)}) fits these recordings.",
        hint="Name sessions, roles or groups in the mapping.",
    )


def _require_first_rows(task: TaskSpec, data: Dataset, split: str) -> None:
    """Raise NotApplicable for recordings whose first row stands for nothing that comes later."""
    asks = f"Protocol {FIRST_FRAME.name!r} asks whether the first row of a recording gives its answer away; "
    why, hint = "", "Compare with split `shuffled` instead."
    changing = next((one for one in data.tables if len(np.unique(one.y[one.labelled], axis=0)) > 1), None)
    if changing is not None:
        why = f"the answer of task {task.name!r} changes within recording {changing.meta.name!r}"
    elif not any(table.labelled[:1].any() for table in data.tables):
        why = f"the first row of no recording has an answer to task {task.name!r}"
    elif all(len(table.row) == 1 for table in data.tables):
        why = "each of these recordings is one reading"
    elif split == "in-session":
        why, hint = "split 'in-session' tests the end of every recording", "Use a split that keeps recordings whole."
    if why:
        raise NotApplicable(f"{asks}{why}.", hint=hint)


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


def used_rows(assignments: Sequence[Assignment]) -> Mask:
    """Return the rows that some fold trains, validates or tests on, as a mask."""
    sets = [mask for one in assignments for mask in (one.train, one.test, one.validation) if mask is not None]
    return np.asarray(np.logical_or.reduce(sets))


def without_part(data: Dataset, split: str, used: Mask) -> dict[str, int]:
    """Return how many recordings no fold uses, by their role; few shots leave recordings out by design."""
    if shots(split) is not None:
        return {}
    unused = [meta.role for meta, mask in zip(data.metas, data.parted(used), strict=True) if not mask.any()]
    return {
        f"recordings {f'of role {role}' if role else 'without a role'} that take no part in split {split}": count
        for role, count in Counter(unused).items()
    }


def training_sessions(data: Dataset) -> list[str]:
    """Return the sessions to train on, those first that few shots take first.

    Sessions with recordings of role train and none of role test, in order of their names, numbers read as numbers.
    """
    tested = {meta.session for meta in data.metas if meta.role == "test"}
    found = {meta.session for meta in data.metas if meta.role == "train"} - tested
    # Every second part of a name is a number.
    return sorted(found, key=lambda name: [int(part) if place % 2 else part
                                           for place, part in enumerate(re.split(r"([0-9]+)", name))])  # fmt: skip


def make_splits(data: Dataset, split: str, seed: int, gap: int = 0, *, one_by_one: bool = False) -> list[Assignment]:
    """Return the folds of `split`.

    Parameters
    ----------
    one_by_one
        Leave each group out alone, as those of `ONE_BY_ONE`, rather than dealing groups into folds, if there are no
        more than `MOST_ONE_BY_ONE`.
    gap
        Rows left out between training and test where a recording is cut in time: the longest window that may be chosen.

    Notes
    -----
    Recordings whose role is ``test`` are an official test set: only split ``roles`` touches them.
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
        return [_told(_held_out(data, split, {name}, f"{split} {name}"), data) for name in names]
    return [_held_out(data, split, values, f"{split} fold {number}") for number, values in enumerate(_dealt(sizes), 1)]


def _open_to_folds(data: Dataset) -> list[int]:
    """Return the recordings that cross-validation may use."""
    free = [place for place, meta in enumerate(data.metas) if meta.role != "test"]
    return free or list(range(len(data.tables)))


def _open_rows(data: Dataset) -> Mask:
    """Return the rows of the recordings that cross-validation may use, as a mask."""
    return np.isin(data.recording, _open_to_folds(data))


def _by_roles(data: Dataset, number: int | None, name: str) -> Assignment:
    """Return the official sets; of few shots only the first `number` training sessions, without validation."""
    train, validation, test = (
        data.column(lambda table: table.meta.role == role)  # noqa: B023
        for role in ("train", "validation", "test")
    )
    if number is not None:
        train = np.isin(data.column(lambda table: table.meta.session), training_sessions(data)[:number])
    return Assignment(name, train, test, validation if validation.any() and number is None else None)


def _in_session(data: Dataset, gap: int) -> Iterator[Assignment]:
    """Within each session, the first part of every recording's labelled rows trains, the rest tests."""
    opened, session = _open_rows(data), data.column(lambda table: table.meta.session)
    for name in np.unique(session[opened]).tolist():
        train, test = _cut_in_time(data, opened & (session == name), gap, fewest=10)
        if test.any():
            yield Assignment(name, train, test)


def _cut_in_time(data: Dataset, rows: Mask, gap: int, fewest: int) -> tuple[Mask, Mask]:
    """Return the first part in time of each recording and, after a gap, the last; none of fewer labelled rows."""
    before, after = [], []
    for table, mask in zip(data.tables, data.parted(rows), strict=True):
        labelled, number = np.flatnonzero(mask & table.labelled), np.arange(len(table.row))
        enough = len(labelled) >= fewest
        first = labelled[int(TRAIN_SHARE * len(labelled))] if enough else len(number)
        before.append(mask & (number < first - gap) & enough)
        after.append(mask & (number >= first))
    return np.concatenate(before), np.concatenate(after)


def _told(fold: Assignment, data: Dataset) -> Assignment:
    """Add to the name of a fold that tests one single number whether training had numbers on both sides of it."""
    y = data.column(lambda table: table.y)
    if data.classes or y.ndim > 1:
        return fold
    train, test = (y[rows & data.labelled] for rows in (fold.train, fold.test))
    if not len(train) or not len(test) or np.ptp(test) > 0:
        return fold
    between = train.min() < test[0] < train.max()
    return replace(fold, name=f"{fold.name}, {'interpolated' if between else 'extrapolated'}")


def _dealt(sizes: Mapping[str, int]) -> list[set[str]]:
    """Deal groups into folds of about equal size, the largest first into the emptiest, of equal ones the first by name.

    Neither chance nor the order of files decides; scikit-learn's ``GroupKFold`` takes equal groups in another order.
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
    """Return (rows,) labels of a group; empty ones of recordings that have none."""
    return data.column(lambda table: table.groups.get(group, ""))


def _shuffled(data: Dataset, seed: int) -> Iterator[Assignment]:
    """Deal rows at random; where recordings are answered whole, deal those, class by class, in about equal shares."""
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
    """Return (train, validation) masks inside the training rows of `outer`, for choosing hyper-parameters.

    What the outer split keeps apart is kept apart here too: each session (or group) is left out once, in five folds
    where there are more than five. With a single one, the last fifth in time of each recording is held back; where
    recordings are answered whole, a fifth of them.
    """
    groups, sizes = outer.groups, _sizes(data, outer.train, outer.groups)
    if data.whole and len(sizes) < 2:
        groups, sizes = "recording", _sizes(data, outer.train, "recording")
    if len(sizes) < 2:
        return [_cut_in_time(data, outer.train, gap, fewest=5)]
    held_out = [np.isin(_labels(data, groups), sorted(values)) for values in _dealt(sizes)]
    return [(outer.train & ~out, outer.train & out) for out in held_out]


def with_validation(outer: Assignment, data: Dataset) -> Assignment:
    """Return a fold whose training recordings are parted in some to learn from and some to choose a threshold on.

    Of the inner splits so many as it takes to validate on events and on disturbances, if there are any.
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
        f"The training recordings of fold {outer.name!r} cannot be parted in some to learn from and some to choose a "
        "threshold on, each with events.",
        hint="Give more of them, or recordings of the role validation.",
    )


def _sizes(data: Dataset, rows: Mask, group: str) -> dict[str, int]:
    """Return how many of some rows each group has that are labelled."""
    values, counts = np.unique(_labels(data, group)[rows & data.labelled], return_counts=True)
    return dict(zip(values.tolist(), counts.tolist(), strict=True))


def over_rows(assignment: Assignment, made: Dataset, recorded: Dataset) -> Assignment:
    """Return an assignment of derived rows (frames, windows) as one of all rows recorded.

    Of windows their last rows; all rows of a recording that was made to frames, or to one row.
    """

    def spread(rows: Mask) -> Mask:
        return np.concatenate([
            np.isin(table.row, own.row[mask]) if own.X.ndim > 2
            else mask if len(mask) == len(table.row) else np.full(len(table.row), bool(mask[0]))
            for mask, own, table in zip(made.parted(rows), made.tables, recorded.tables, strict=True)
        ])  # fmt: skip

    validation = None if assignment.validation is None else spread(assignment.validation)
    return replace(assignment, train=spread(assignment.train), test=spread(assignment.test), validation=validation)

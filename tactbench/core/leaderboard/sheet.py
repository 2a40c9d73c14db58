"""Rows laid out by key: what is asked of every row is asked once, and every later look is at a list."""

from __future__ import annotations

import marshal
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import chain, repeat
from operator import itemgetter
from typing import Any

from tactbench.core.leaderboard.names import answer_name, sensor_name
from tactbench.core.spec.row import FORMAT

Row = Mapping[str, Any]
Columns = Mapping[str, Sequence[Any]]


MOST_OTHERS = 200
"""Keys of no format of ours that are laid out where rows differ in theirs, those that most rows have: rows of a
stranger may have a million, each its own."""


def columns_of(rows: Sequence[Row]) -> tuple[Columns, frozenset[str]]:
    """Return one value a row under each key that some row has, and the keys that every row has.

    Returns
    -------
    dict, frozenset
        Keys in order; None where a row lacks one.
    """
    found = alike(rows)
    if found is not None:
        return found, frozenset(found)
    counts = Counter(chain.from_iterable(rows))
    others = [key for key, _ in counts.most_common() if key not in FORMAT][:MOST_OTHERS]
    known = sorted([*others, *(key for key in FORMAT if key in counts)], key=str)
    everywhere = frozenset(key for key in known if counts[key] == len(rows))
    return {key: [row.get(key) for row in rows] for key in known}, everywhere


def alike(rows: Sequence[Row]) -> Columns | None:
    """Return one value a row under each key, keys in order; None if there are no rows or their keys differ."""
    if len(set(map(len, rows))) != 1 or len(rows[0]) < 2:
        return None
    keys = sorted(rows[0], key=str)
    try:
        return dict(zip(keys, zip(*map(itemgetter(*keys), rows), strict=True), strict=True))
    except KeyError:
        return None


def marks_of(values: Sequence[Any]) -> Sequence[Any]:
    """Return one mark a value; values of one mark are equal, to the type. What rows share is looked at once."""
    ids = list(map(id, values))
    if 2 * len(set(ids)) > len(values):
        return _content(values)
    distinct = dict(zip(ids, values, strict=True))
    marks = dict(zip(distinct, _content(list(distinct.values())), strict=True))
    return list(map(marks.__getitem__, ids))


def _content(values: Sequence[Any]) -> Sequence[Any]:
    try:
        # Version 2 of the format writes equal values of equal types as equal bytes; it is never read.
        return list(map(marshal.dumps, values, repeat(2)))
    except ValueError:  # some hold what is not plain, or are endless
        return list(map(id, values))


class Sheet(Mapping[str, Sequence[Any]]):
    """The rows of a table and, under each of their keys, one value a row: None where a row lacks it.

    Parameters
    ----------
    rows
        Rows in any order.
    columns
        The same by key, if known already.
    """

    def __init__(self, rows: Sequence[Row], columns: Columns | None = None) -> None:
        self.rows = rows
        self._columns = columns_of(rows)[0] if columns is None else columns
        self._types: dict[str, frozenset[type]] = {}

    @classmethod
    def by_name(cls, rows: Sequence[Row]) -> Sheet:
        """Return rows in the order of their cells' names: what neighbours share lies together."""
        return cls(sorted(rows, key=itemgetter("cell")))

    def __getitem__(self, key: str) -> Sequence[Any]:
        """Return the values under a key; KeyError if there are rows and none has it."""
        return self._columns[key] if self.rows else ()

    def __iter__(self) -> Iterator[str]:
        """Iterate over the keys."""
        return iter(self._columns)

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(self._columns)

    def known(self, key: str) -> Sequence[Any]:
        """Return the values under a key that rows may lack."""
        return self._columns.get(key) or (None,) * len(self.rows)

    def types(self, key: str) -> frozenset[type]:
        """Return the types of the values under a key."""
        if key not in self._types:
            self._types[key] = frozenset(map(type, self[key]))
        return self._types[key]

    def taken(self, places: Sequence[int]) -> Sheet:
        """Return the rows at these places, in this order."""
        return Sheet([self.rows[place] for place in places], _Taken(self, places))

    def told(self, told: Callable[[Row], str], *keys: str) -> list[str]:
        """Return what `told` returns for each row; it is asked once of those that have the same under `keys`."""
        marks = list(zip(*map(self.known, keys), strict=True))
        answers = {mark: told(row) for mark, row in dict(zip(marks, self.rows, strict=True)).items()}
        return list(map(answers.__getitem__, marks))

    @cached_property
    def sensors(self) -> list[str]:
        """The name of each row's sensor, as shown."""
        return self.told(sensor_name, "sensor", "simulated", "emulated")

    @cached_property
    def answers(self) -> list[str]:
        """The name of each row's estimator, as shown."""
        plain = self.told(lambda row: answer_name({**row, "params": {}}), "estimator")
        given = zip(self["params"], plain, self.rows, strict=True)
        return [answer_name(row) if params else name for params, name, row in given]


class _Taken(Mapping[str, Sequence[Any]]):
    """Columns of some of the rows, made when they are asked for."""

    def __init__(self, columns: Columns, places: Sequence[int]) -> None:
        self._columns = columns
        self._places = places
        self._made: dict[str, Sequence[Any]] = {}

    def __getitem__(self, key: str) -> Sequence[Any]:
        if key not in self._made:
            self._made[key] = list(map(self._columns[key].__getitem__, self._places))
        return self._made[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

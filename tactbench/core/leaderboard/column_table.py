"""Rows by key: one list of values a key, one value a row."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import chain
from operator import itemgetter
from typing import Any

from tactbench.core.leaderboard.names import answer_name, sensor_name
from tactbench.core.spec.row import FORMAT

Row = Mapping[str, Any]

MOST_OTHERS = 200
"""Keys of no format of ours that are listed, those that most rows have: rows of a stranger may have a million."""


class ColumnTable(Mapping[str, Sequence[Any]]):
    """Rows and, under each of their keys, one value a row: None where a row lacks it."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = rows
        self._columns: dict[str, list[Any]] = {}

    @classmethod
    def by_name(cls, rows: Sequence[Row]) -> ColumnTable:
        """Return rows in the order of their cells' names."""
        return cls(sorted(rows, key=itemgetter("cell")))

    @cached_property
    def _keys(self) -> list[str]:
        counts = Counter(chain.from_iterable(self.rows))
        others = [key for key, _ in counts.most_common() if key not in FORMAT][:MOST_OTHERS]
        return sorted([*others, *(key for key in FORMAT if key in counts)], key=str)

    def __getitem__(self, key: str) -> Sequence[Any]:
        """Return the values under a key; KeyError if there are rows and none has it."""
        if key not in self._columns:
            if self.rows and not any(key in row for row in self.rows):
                raise KeyError(key)
            self._columns[key] = [row.get(key) for row in self.rows]
        return self._columns[key]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the keys."""
        return iter(self._keys)

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(self._keys)

    def known(self, key: str) -> Sequence[Any]:
        """Return the values under a key that rows may lack."""
        return self.get(key) or [None] * len(self.rows)

    def taken(self, places: Sequence[int]) -> ColumnTable:
        """Return the rows at these places, in this order."""
        return ColumnTable([self.rows[place] for place in places])

    @cached_property
    def sensors(self) -> list[str]:
        """The name of each row's sensor, as shown."""
        return list(map(sensor_name, self.rows))

    @cached_property
    def answers(self) -> list[str]:
        """The name of each row's estimator, as shown."""
        return list(map(answer_name, self.rows))

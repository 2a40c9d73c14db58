"""Texts and numbers in a form that can be printed, as JSON and CSV, and the table that formats for people render."""

from __future__ import annotations

import csv
import io
import json
import math
import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any


def visible(text: str) -> str:
    r"""Return `text` on one line, with every unprintable character written out as an escape.

    Control characters, marks that turn the direction of reading and lone surrogates become ``\x1b``, ``\u202e`` or
    ``\U000e0001``; line breaks, tabs and spaces of any width become one space each.
    """
    return text if text.isprintable() else "".join(map(_shown, text))


def visible_lines(text: str) -> str:
    """Return `text` with unprintable characters escaped as by `visible`; line breaks are kept."""
    return "\n".join(map(visible, text.split("\n")))


def _shown(character: str) -> str:
    if character.isprintable():
        return character
    return " " if character.isspace() else character.encode("unicode_escape").decode()


def command_line(*words: str) -> str:
    """Return the words as a shell command with quotes where needed; unprintable characters are escaped."""
    return visible(shlex.join(words))


def cut(text: str, most: int) -> str:
    """Return `text`, cut to `most` characters with an ellipsis at the end if it is longer."""
    return text if len(text) <= most else text[: most - 1] + "…"


def json_text(value: Any, **how: Any) -> str:
    """Return `value` as JSON of ASCII characters; NaN and infinity become null."""
    try:
        return json.dumps(value, allow_nan=False, **how)
    except ValueError:
        return json.dumps(_finite(value), allow_nan=False, **how)


def _finite(value: Any) -> Any:
    """Return `value` with None in place of NaN and infinity, in nested lists and dicts too."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return value


def csv_text(names: Iterable[str], lines: Iterable[Iterable[Any]]) -> str:
    """Return lines as CSV text with a header of `names`; lists and mappings in a field become JSON."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([in_a_field(value) for value in line] for line in lines)
    return out.getvalue()


def in_a_field(value: Any) -> Any:
    """Return a list or a mapping as JSON, any other value as it is."""
    return json_text(value) if isinstance(value, list | tuple | dict) else value


ABSENT = "–"


def score(value: float | None, unit: str) -> str:
    """Return a score as text: three decimals if its unit is 1; otherwise four decimals, or two from 10 on."""
    if value is None:
        return ABSENT
    return f"{value:.3f}" if unit == "1" else f"{value:.4f}" if -10 < value < 10 else f"{value:.2f}"


def interval(low: float | None, high: float | None, unit: str) -> str:
    """Return an interval as text with the decimals of `score`; its upper end is "open" if `high` is None."""
    return ABSENT if low is None else f"{score(low, unit)} … {'open' if high is None else score(high, unit)}"


def signed(value: float, unit: str) -> str:
    """Return a difference of scores as text with its sign and the decimals of `score`."""
    return ("+" if value >= 0 else "−") + score(abs(value), unit)


def suffix(unit: str) -> str:
    """Return the text to append to a number: a space and the unit, or nothing if the unit is 1."""
    return "" if unit == "1" else f" {unit}"


def score_with_unit(value: float | None, unit: str) -> str:
    """Return a score as text with its unit, as ``0.1234 N``."""
    return score(value, unit) + suffix(unit)


def duration(seconds: float | None) -> str:
    """Return a duration as text with three significant digits, in s, ms or µs."""
    if seconds is None:
        return ABSENT
    scales = ((value, unit) for value, unit in ((seconds, "s"), (seconds * 1e3, "ms")) if value >= 0.9995)
    value, unit = next(scales, (seconds * 1e6, "µs") if seconds else (0, "s"))
    return f"{value:.{0 if value >= 99.95 else 1 if value >= 9.995 else 2}f} {unit}"


def delay(known_ms: float | None, parts_ms: Mapping[str, float] | None) -> str:
    """Return the delay of an answer as text, with ≥ if the delay of the sensor's link is unknown."""
    if known_ms is None:
        return ABSENT
    least = "≥ " if parts_ms and "window" in parts_ms and "link" not in parts_ms else ""
    return f"{least}{duration(known_ms / 1e3)}"


def whole(value: int | None) -> str:
    """Return a count as text, with a thin space between groups of three digits."""
    return ABSENT if value is None else f"{value:,}".replace(",", "\u202f")


WORDY = 60
"""Number of characters beyond which a field is wrapped as prose."""


class Entry(str):
    """Text of a table field, with the number for sorting and the name of the cell to link to."""

    __slots__ = ("cell", "value")
    value: float | None
    """Number by which the column is sorted, in one unit for the whole column; None sorts last."""
    cell: str
    """Name of the cell with this result, for a link to the cell's details; empty: no link."""

    def __new__(cls, text: str, value: float | None = None, *, cell: str = "") -> Entry:
        """Return the text with its number and the name of its cell."""
        entry = super().__new__(cls, text)
        entry.value, entry.cell = value, cell
        return entry


@dataclass(frozen=True)
class TextTable:
    """A table of texts: title, columns, lines and notes."""

    title: str
    columns: tuple[str, ...]
    """Names of the columns, from left to right."""
    lines: tuple[tuple[str, ...], ...]
    """Texts of each line, one for each column; some may be of the type `Entry`."""
    numeric: frozenset[str] = frozenset()
    """Names of the columns aligned to the right and sorted by number."""
    headings: tuple[str, ...] = ()
    """Headings of the columns; empty: their names."""
    kinds: tuple[str, ...] = ()
    """Style of each line: ``result``, ``baseline``, ``failed``, ``alarm`` …; empty: plain."""
    origin: str = ""
    """Text to the right of the title: origin of the numbers, such as simulated or measured."""
    summary: tuple[str, ...] = ()
    """Sentences between the title and the lines of the table."""
    notes: tuple[str, ...] = ()
    """Sentences below the lines of the table."""
    first_to_go: tuple[str, ...] = ()
    """Columns to leave out, in this order, on a terminal that is too narrow even with texts broken at spaces."""
    unbroken: frozenset[str] = frozenset()
    """Names of columns whose texts are not broken into lines, so that they can be copied."""

    @property
    def headers(self) -> tuple[str, ...]:
        """Headings of the columns, by default their names."""
        return self.headings or self.columns

    @property
    def right(self) -> tuple[bool, ...]:
        """For each column, True if it is aligned to the right."""
        return tuple(name in self.numeric for name in self.columns)

    @property
    def wordy(self) -> bool:
        """True if a field has more than `WORDY` characters; a narrow screen then shows field below field."""
        return any(len(text) > WORDY for line in self.lines for text in line)

    def compact(self, keep: Collection[str] = ()) -> TextTable:
        """Return the table without columns that are empty in all lines, except for columns in `keep`."""
        kept = [
            place for place, name in enumerate(self.columns)
            if not self.lines or name in keep or any(line[place].strip(ABSENT) for line in self.lines)
        ]  # fmt: skip

        def only(texts: Sequence[str]) -> tuple[str, ...]:
            return tuple(texts[place] for place in kept)

        headings = only(self.headings) if self.headings else ()
        return replace(self, columns=only(self.columns), lines=tuple(map(only, self.lines)), headings=headings)


def sort_value(text: str) -> float | None:
    """Return the number by which a text is sorted: the value of an `Entry`, else the text as a number, or None."""
    if isinstance(text, Entry):
        return text.value
    try:
        return finite(float(text.replace("\u202f", "").replace("−", "-")))
    except ValueError:
        return None


def finite(value: object) -> float | None:
    """Return `value` as a float if it is a finite number, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def text_table(
    title: str,
    columns: Sequence[str],
    lines: Iterable[Sequence[str]],
    *,
    numeric: Collection[str] = (),
    notes: Sequence[str] = (),
    kinds: Sequence[str] = (),
) -> TextTable:
    """Return the table of `lines`, without columns that are empty in all lines."""
    given = tuple(map(tuple, lines))
    return TextTable(title, tuple(columns), given, frozenset(numeric), kinds=tuple(kinds), notes=tuple(notes)).compact()


def records_table(
    title: str, records: Sequence[Mapping[str, Any]], columns: Sequence[str] = (), *, kinds: Sequence[str] = ()
) -> TextTable:
    """Return a table with one line for each record and the keys `columns` (default: all); numbers are aligned right."""
    shown = columns or tuple(dict.fromkeys(name for record in records for name in record))
    lines = [[Entry(field_text(one.get(name)), finite(one.get(name))) for name in shown] for one in records]
    numeric = [name for name in shown if any(finite(one.get(name)) is not None for one in records)]
    return text_table(title, shown, lines, numeric=numeric, kinds=kinds)


def field_text(value: Any) -> str:
    """Return a value, such as a list or mapping, as text for a table field; empty for None."""
    from pydantic import BaseModel

    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json")
    if isinstance(value, Mapping):
        return ", ".join(f"{name} = {text}" for name, one in value.items() if (text := field_text(one)))
    if isinstance(value, list | tuple):
        return ", ".join(map(field_text, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}" if isinstance(value, float) else "" if value is None else str(value)

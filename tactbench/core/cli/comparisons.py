"""How verbs print comparisons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from tactbench.core.cli.grid import print_records, print_tables

COMPARISON_FORMATS = ("table", "md", "json", "csv")


def print_comparisons(rows: Sequence[Mapping[str, Any]], by: str, shape: str) -> None:
    """Print what of `rows` was asked in several ways.

    Parameters
    ----------
    by
        Protocol, split or fold.
    shape
        One of `COMPARISON_FORMATS`.

    Raises
    ------
    UsageError
        If nothing was asked in several ways, or there is no such format.
    """
    from tactbench.core.cli.screen import remark
    from tactbench.core.errors import UsageError
    from tactbench.core.leaderboard.side_by_side import compare

    if shape not in COMPARISON_FORMATS:
        raise UsageError(
            f"A comparison cannot be printed as {shape}.", hint=f"Formats: {', '.join(COMPARISON_FORMATS)}."
        )
    tables = compare(rows, by)
    if not tables:
        raise UsageError(
            f"These rows hold no question that was asked with more than one {by}.",
            hint="Ask so first, for example `tactbench run --config protocols` or `tactbench run --config beyond`.",
        )
    if shape in ("json", "csv"):
        print_records([record for table in tables for record in table.records], shape)
        return
    print_tables([replace(table, notes=()) for table in tables], shape)
    for note in dict.fromkeys(note for table in tables for note in table.notes):
        remark(note)

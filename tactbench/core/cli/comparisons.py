"""How verbs print what was asked in several ways, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from tactbench.core.cli.grid import print_records, print_tables

if TYPE_CHECKING:
    from tactbench.core.tables.text_table import TextTable

COMPARISON_FORMATS = ("table", "md", "json", "csv")


def print_comparisons(tables: Sequence[TextTable], shape: str = "table") -> None:
    """Print tables of `compare` in one of `COMPARISON_FORMATS`."""
    from tactbench.core.cli.screen import remark

    if shape in ("json", "csv"):
        print_records([record for table in tables for record in table.records], shape)
        return
    print_tables([replace(table, notes=()) for table in tables], shape)
    for note in dict.fromkeys(note for table in tables for note in table.notes):
        remark(note)

"""How ``tactbench calibrate`` prints what a calibration says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.grid import GRID_FORMATS

if TYPE_CHECKING:
    from tactbench.core.calibration.result import CalibrationResult
    from tactbench.core.calibration.summary import Summary

CALIBRATION_FORMATS = (*GRID_FORMATS, "md")


def print_calibration(result: CalibrationResult, stats: Summary, shape: str) -> None:
    """Print what a calibration says in one of `CALIBRATION_FORMATS`."""
    from tactbench.core.calibration.summary import records
    from tactbench.core.calibration.tables import markdown, text_tables
    from tactbench.core.cli.grid import print_records, print_tables
    from tactbench.core.cli.screen import remark

    if shape == "md":
        click.echo(markdown(result, stats), nl=False)
    elif shape != "table":
        print_records(_long(records(stats)), shape)
    else:
        click.echo(f"{result.spec.title} (SIM)\n")
        print_tables(text_tables(result, stats))
    if stats.failed:
        reasons = sorted({draw.reason for draw in result.draws if draw.status == "failed"})
        remark(f"{stats.failed} draws failed: {reasons[0]}" + (" …" if len(reasons) > 1 else ""))


def _long(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Return all tables as records of one shape, each with the name of its table."""
    keys = list(dict.fromkeys(key for lines in tables.values() for line in lines for key in line))
    return [
        {"table": table, **{key: line.get(key) for key in keys}} for table, lines in tables.items() for line in lines
    ]

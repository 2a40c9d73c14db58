"""Options that several verbs share, and output of tables and records on stdout."""

from __future__ import annotations

import math
import shutil
import sys
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from tactbench.core.tables.markup import latex, markdown
from tactbench.core.tables.terminal import WITHOUT_EDGE, show
from tactbench.core.tables.text import TextTable, csv_text, json_text, records_table, visible
from tactbench.core.tables.text import field_text as field_text

Command = Callable[..., Any]


class FiniteRange(click.FloatRange):
    """Option type for a range of finite numbers; `click.FloatRange` alone would accept NaN."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return `value` as a number; raise a usage error if it is not finite or out of range."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


DEFAULT_FOLDER = Path("tactbench-results")
ABOVE_0 = FiniteRange(min=0, min_open=True)


def options(*several: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Return a decorator that adds options to a verb, listed in the given order in its help."""

    def add(command: Command) -> Command:
        for option in reversed(several):
            command = option(command)
        return command

    return add


def format_option(*shapes: str) -> Callable[[Command], Command]:
    """Return the option ``--format`` with the choices `shapes`, the first of which is the default."""
    return click.option("--format", "shape", type=click.Choice(shapes), default=shapes[0],
                        help="Output format.")  # fmt: skip


YES = click.option("--yes", is_flag=True, help="Do not prompt.")
RESULTS = click.option("--out", type=click.Path(path_type=Path), default=DEFAULT_FOLDER,
                       metavar="DIR", help="Result folder.")  # fmt: skip
JOBS = click.option("--jobs", type=click.IntRange(min=1), metavar="N",
                    help="Parallel worker processes. Default: one per usable core.")  # fmt: skip

EFFECTS = click.option(
    "--effects", metavar="LIST",
    help="Force effects in or out: +creep,-drift; groups and +all, -all too. With a plain name an "
    "effect of another package takes part where a scene calls for it.",
)  # fmt: skip
SIMULATION = options(
    EFFECTS,
    click.option(
        "--set", "settings", multiple=True, metavar="NAME=VALUE",
        help="Set a nuisance (placement_scatter_mm=0.3), or rung, tolerance or scenario of the simulation; repeatable.",
    ),
)  # fmt: skip
"""Options --effects and --set, for `tactbench.core.study.options.simulation_of`."""


GRID_FORMATS = ("table", "json", "csv")


def print_tables(tables: Sequence[TextTable], shape: str = "table") -> None:
    """Print tables on stdout as ``table``, ``md`` or ``latex``."""
    if shape == "table":
        show(tables)
    else:
        click.echo((markdown if shape == "md" else latex)(tables), nl=False)


def print_fields(fields: Sequence[tuple[str, str]]) -> None:
    """Print (name, value) pairs on stdout, one line for each; long values are wrapped to the terminal's width."""
    left = max((len(name) for name, _ in fields), default=0) + 2
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else WITHOUT_EDGE
    for name, value in fields:
        lines = textwrap.wrap(
            f"{visible(name):<{left}}{visible(value)}", width, subsequent_indent=" " * left,
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
        click.echo("\n".join(lines))


def print_records(
    records: Sequence[Mapping[str, Any]], shape: str, *, title: str = "", columns: Sequence[str] = (),
    kinds: Sequence[str] = (),
) -> None:  # fmt: skip
    """Print records on stdout as ``json``, ``csv`` or ``table``; the keys of the first record apply to all.

    Parameters
    ----------
    title, columns, kinds
        For a table: its title; the keys shown as columns (default: all), empty columns left out; and one word for each
        record that selects the style of its line, see `tactbench.core.tables.terminal`.
    """
    if shape == "json":
        click.echo(json_text(list(records), indent=1))
    elif shape == "csv":
        click.echo(csv_text(records[0] if records else (), (one.values() for one in records)), nl=False)
    elif records:
        print_tables([records_table(title, records, columns or tuple(records[0]), kinds=kinds)])

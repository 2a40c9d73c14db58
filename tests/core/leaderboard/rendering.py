"""Rows in each format, as the command writes their table."""

from tactbench.core.leaderboard.formats import latex, markdown
from tactbench.core.leaderboard.records import csv_text, json_array, parquet
from tactbench.core.leaderboard.table import build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW


def to_json(rows, provenance=(), *, times=True):
    return json_array(build_table(rows, provenance, times=times))


def to_csv(rows, provenance=(), *, times=True):
    return csv_text(build_table(rows, provenance, times=times))


def to_markdown(rows, provenance=(), *, times=True, view=DEFAULT_VIEW):
    return markdown(build_table(rows, provenance, times=times), view)


def to_latex(rows, provenance=(), *, times=True, view=DEFAULT_VIEW):
    return latex(build_table(rows, provenance, times=times), view)


def to_parquet(rows, provenance=(), *, times=True):
    return parquet(build_table(rows, provenance, times=times))

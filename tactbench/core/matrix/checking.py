"""Whether what came back from a cell is what a cell gives; a plugin may have lied to whoever computed it.

Whether its row is plain data, the store finds out when it writes it (`NotPlainError`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from tactbench.core.matrix.evaluate_cell import FIXED
from tactbench.core.matrix.store import Row
from tactbench.core.matrix.store.rows import fault_in_row
from tactbench.core.samples import Answers
from tactbench.core.spec.task import VECTOR_METRIC

_COLUMNS = tuple(column.name for column in fields(Answers))

SAME_SCORE = 1e-9
"""Relative difference of two scores of the same answers: sums of a million terms in another order, as on another kind
of processor, differ by less."""


def fault_in(given: Any, opened: Row) -> str:
    """Return what is wrong with what a cell gave, as a clause; "" if nothing is.

    Parameters
    ----------
    given
        What came; a row and the columns of its answers by role are wanted.
    opened
        The row as it was before anything was computed: it has every key, and says what was asked.
    """
    if not (isinstance(given, tuple) and len(given) == 2 and isinstance(given[0], dict)):
        return f"it gave a {type(given).__name__} and not a row with its answers"
    row, sets = given
    if row.keys() != opened.keys():
        return f"its row has other keys: {', '.join(sorted(map(str, row.keys() ^ opened.keys())))}"
    for name in FIXED:
        if row[name] != opened[name]:
            return f"its row is that of another cell: its {name} is {row[name]!r}, not {opened[name]!r}"
    if row["status"] != "done":
        return f"its status is {row['status']!r}"
    fault = fault_in_row(row)
    if fault:
        return fault
    for name in ("score", "ci_low", "ci_high"):
        if row[name] is None and name != "score":
            continue  # an interval may be undefined
        if row[name] is None or not math.isfinite(row[name]):
            return f"its {name} is {row[name]!r}, not a finite number"
    return _fault_in_answers(sets, row)


def _fault_in_answers(sets: Any, row: Row) -> str:
    if not (isinstance(sets, Mapping) and "test" in sets):
        return "it has no answers to the test set"
    for role, columns in sets.items():
        if not (isinstance(columns, Mapping) and columns.keys() == set(_COLUMNS)):
            return f"its {role} answers are a {type(columns).__name__} without the columns of answers"
        for name, column in columns.items():
            dimensions = 2 if name in ("y_true", "y_pred") and row["metric"] == VECTOR_METRIC else 1
            if not (isinstance(column, np.ndarray) and column.ndim == dimensions and column.dtype.kind in "biufSU"):
                return f"its {role} answers have no plain column {name}"
        lengths = {name: len(column) for name, column in columns.items()}
        if len(set(lengths.values())) != 1:
            return f"the columns of its {role} answers differ in length: {lengths}"
        if columns["y_pred"].dtype.kind == "f" and not np.isfinite(columns["y_pred"]).all():
            return f"some of its {role} answers are NaN or infinite"
    given = len(sets["test"]["y_true"])
    if given != row["n_test"]:
        return f"it gave {given} test answers and says {row['n_test']}"
    # The score is computed anew from the answers that are kept, in this process, where no plugin has run.
    from tactbench.core.evaluation.metrics import metric_called

    test = sets["test"]
    try:
        found = metric_called(row["metric"]).of(test["y_true"], test["y_pred"], len(row["classes"]))
    except (TypeError, ValueError, IndexError) as error:
        return f"its answers have no {row['metric']}: {error}"
    if not math.isclose(found, row["score"], rel_tol=SAME_SCORE, abs_tol=SAME_SCORE):
        return f"its score is {row['score']!r}, and its answers give {found!r}"
    return ""

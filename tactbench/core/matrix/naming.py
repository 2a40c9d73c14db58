"""Which cell a person means, and what a row says about how it was asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from tactbench.core.errors import UsageError, did_you_mean
from tactbench.core.matrix.plan import ALIKE, Cell
from tactbench.core.spec.scene import Simulation

_SHOWN = 8
"""Cells named in a message."""


def meant(given: str, names: Sequence[str]) -> str:
    """Return the name of the cell that `given` stands for: its name, a part of only one name, or some of its parts.

    ``biotac/curvature/forest`` is ``biotac/curvature/twin/karl2016/forest/1`` where no other cell has these parts.

    The replicates of a cell differ in the last part of their names alone: what names them all, with or without that
    part, stands for the first of them.

    Parameters
    ----------
    names
        Of the cells there are.

    Raises
    ------
    UsageError
        If several cells are meant (the message lists them), or none.
    """
    if given in names:
        return given
    found = (
        [name for name in names if _parts(name)[0] == given]
        or [name for name in names if given in name]
        or [name for name in names if _is_short(given, name)]
    )
    if len({_parts(name)[0] for name in found}) == 1:
        return min(found, key=lambda name: _parts(name)[1])
    if not found:
        raise UsageError(
            f"There is no cell called {given!r} among {len(names)}.",
            hint=did_you_mean(given, names).strip() or "`tactbench leaderboard --format json` has their names.",
        )
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    raise UsageError(
        f"{given!r} is part of the names of {len(found)} cells.",
        hint=f"Give more of the name of one: {', '.join(found[:_SHOWN])}{more}.",
    )


def _is_short(given: str, name: str) -> bool:
    """Return whether the parts of `given` are parts of a name, in their order."""
    parts = iter(name.split("/"))
    return all(one in parts for one in given.split("/"))


def _parts(name: str) -> tuple[str, int]:
    """Return what the replicates of a cell have in common, and which one this is."""
    cell, _, repeat = name.rpartition("/")
    return (cell, int(repeat)) if repeat.isdecimal() else (name, 0)


def cell_of(row: Mapping[str, Any]) -> Cell:
    """Return the cell that a row answers."""
    cell = Cell(
        **{name: row[name] for name in ALIKE},
        params=tuple(sorted(row["params"].items())),
        baseline=row["is_baseline"],
        timed=row["status"] != "done" or row["latency_n"] is not None,
        simulation=Simulation.model_validate(row["simulation"]),
    )
    # A row says which split was taken; its name, whether that one was asked for or found.
    found = replace(cell, split=None)
    return found if found.name == row["cell"] else cell

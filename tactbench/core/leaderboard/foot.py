"""What stands at the foot of every table: how many runs it is of, and who computed them, with what, where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.leaderboard.sheet import Sheet
from tactbench.core.leaderboard.text import cut, visible

Row = Mapping[str, Any]

MOST_SEEDS = 12
LONGEST = 1000
"""Characters of a sentence; the whole provenance lies in the result folder."""
_WITHOUT = "Times, memory and hosts are left out: a seed decides all that stands here."


def foot_of(sheet: Sheet, provenance: Sequence[Row], times: bool) -> tuple[str, ...]:
    """Return the sentences below a table.

    Parameters
    ----------
    sheet
        All rows of the table.
    provenance
        What is known of the runs they are from; possibly from a stranger's folder.
    times
        False: nothing is said of machines.
    """
    own = zip(sheet.known("seeds"), sheet["seed"], strict=True)
    seeds = _seeds([seed for several, first in own for seed in several or [first]])
    if not times:
        return (f"{_WITHOUT} {seeds}",)
    runs = len(set(filter(None, sheet.known("made_by"))))
    of_runs = f" of {runs} kind{'s' if runs != 1 else ''} of runs (versions, machine, settings)" if runs else ""
    if any((n or 0) > 1 and unit == "replicate" for n, unit in
           zip(sheet.known("n_replicates"), sheet.known("replicate_unit"), strict=True)):  # fmt: skip
        seeds += (
            " One a replicate, which is everything recorded anew; scores are medians, intervals those of the median."
        )
    return (f"{len(sheet.rows)} cells{of_runs}. {seeds}", *(cut(visible(said), LONGEST) for said in _told(provenance)))


def _told(provenance: Sequence[Row]) -> tuple[str, ...]:
    if not provenance:
        return ()
    from tactbench.core.provenance.gather import foot

    try:
        return foot(provenance)
    except (AttributeError, ArithmeticError, LookupError, TypeError, ValueError):
        return ("The provenance of these rows cannot be read.",)


def _seeds(told: Sequence[Any]) -> str:
    seeds = sorted({seed for seed in told if isinstance(seed, int)})
    if not seeds:
        return "Seeds are not known."
    listed = ", ".join(map(str, seeds[:MOST_SEEDS]))
    more = f" and {len(seeds) - MOST_SEEDS} more" if len(seeds) > MOST_SEEDS else ""
    return f"{'Seeds' if len(seeds) > 1 else 'Seed'}: {listed}{more}."

"""What stands in the footer of every table: how many runs it is of, and who computed them, with what, where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tactbench.core.tables.text import cut, visible

Row = Mapping[str, Any]

MOST_SEEDS = 12
LONGEST = 1000
"""Characters of a sentence; the whole provenance lies in the result folder."""
_WITHOUT = "Times, memory and hosts are left out: a seed decides all that stands here."


def footer_of(rows: Sequence[Row], provenance: Sequence[Row], times: bool) -> tuple[str, ...]:
    """Return the sentences below a table.

    Parameters
    ----------
    rows
        All rows of the table.
    provenance
        What is known of the runs they are from; possibly from a stranger's folder.
    times
        False: nothing is said of machines.
    """
    seeds = _seeds([seed for row in rows for seed in row.get("seeds") or [row["seed"]]])
    if not times:
        return (f"{_WITHOUT} {seeds}",)
    runs = len({row.get("made_by") for row in rows} - {None, ""})
    of_runs = f" of {runs} kind{'s' if runs != 1 else ''} of runs (versions, machine, settings)" if runs else ""
    if any((row.get("n_replicates") or 0) > 1 and row.get("replicate_unit") == "replicate" for row in rows):
        seeds += (
            " One a replicate, which is everything recorded anew; scores are medians, intervals those of the median."
        )
    return (
        f"{len(rows)} cells{of_runs}. {seeds}",
        *(cut(visible(sentence), LONGEST) for sentence in _made_by(provenance)),
    )


def _made_by(provenance: Sequence[Row]) -> tuple[str, ...]:
    if not provenance:
        return ()
    from tactbench.core.provenance.gather import foot

    try:
        return foot(provenance)
    except (AttributeError, ArithmeticError, LookupError, TypeError, ValueError):
        return ("The provenance of these rows cannot be read.",)


def _seeds(values: Sequence[Any]) -> str:
    seeds = sorted({seed for seed in values if isinstance(seed, int)})
    if not seeds:
        return "Seeds are not known."
    listed = ", ".join(map(str, seeds[:MOST_SEEDS]))
    more = f" and {len(seeds) - MOST_SEEDS} more" if len(seeds) > MOST_SEEDS else ""
    return f"{'Seeds' if len(seeds) > 1 else 'Seed'}: {listed}{more}."

"""What a measured ladder leaves in a result folder, and how it is read again.

::

    OUT/cost/SENSOR-TASK.json     the whole table, as below
    OUT/cost/SENSOR-TASK.csv      its rows alone
    OUT/cost/SENSOR-TASK.png, .pdf    score against fit time and against answer delay

The JSON file has ``version`` 2, what was asked (``sensor``, ``task``, ``rig``, ``protocol``, ``split``, ``seed``), the
score's ``metric``, ``unit``, ``higher_is_better``, ``simulated`` and ``dagger`` as in a leaderboard's row, how it was
timed (``fold``, ``rounds``, ``budget_s``, ``threads``, ``load``, ``cores``, ``remarks``), ``provenance``, and ``rows``:
one for each estimator, the best score first, what nobody could measure null. Times of different hosts are never
compared. docs/glossary.md says what each time of a row is; ``_q1`` and ``_q3`` are quartiles, ``delay_parts_ms`` what a
delay is the sum of, ``data_s`` the seconds that the training recordings took.
"""

from __future__ import annotations

import json
from pathlib import Path

from tactbench.core.cost.ladder import Ladder
from tactbench.core.errors import UnwritableError
from tactbench.core.files import replace_file
from tactbench.core.tables.csv_text import csv_of_records

VERSION = 2


def write_ladder(ladder: Ladder, folder: Path, metric: str = "") -> list[Path]:
    """Write a ladder's four files into the result folder, each whole or not at all; return their paths.

    `metric` is the score's name for people, in the figure.

    Raises
    ------
    UnwritableError
        If the folder cannot be written.
    """
    from tactbench.core.cost.ladder_figure import draw_ladder

    place = folder / "cost" / f"{ladder.about['sensor']}-{ladder.about['task']}"
    whole = {"version": VERSION, **ladder.about, "rows": ladder.rows}
    paths = [place.with_name(f"{place.name}.{ending}") for ending in ("json", "csv", "png", "pdf")]
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        replace_file(paths[0], text.encode())
        replace_file(paths[1], csv_of_records(ladder.rows).encode())
        draw_ladder(ladder, paths[2:], metric)
    except OSError as error:
        raise UnwritableError(
            f"{place.parent} cannot be written: {error}.", hint="Give another folder with --out."
        ) from error
    return paths

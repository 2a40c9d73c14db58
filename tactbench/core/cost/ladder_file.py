"""What a measured ladder leaves in a result folder, and how it is read again.

::

    OUT/cost/SENSOR-TASK.json     the whole table, as below
    OUT/cost/SENSOR-TASK.csv      its rows alone
    OUT/cost/SENSOR-TASK.png, .pdf    score against fit time and against answer delay

Keys of the JSON file; those that nobody could measure are null:

``version``           2
``sensor, task, rig, protocol, split, seed``      what was asked, as in a leaderboard's row
``metric, unit, higher_is_better``                of the score
``simulated, dagger``     as in a leaderboard's row: recordings of the twin; test-set statistics were used
``fold``              the fold that was timed: the last one
``rounds, budget_s, threads``      how it was timed
``remarks``           on the delay: a link or a rate that is not known, a sensor sampled at another rate than its own
``load, cores``       mean number of processes that wanted to run, in the last minute of it, and cores to run on
``definitions``       one sentence for each time and verdict
``provenance``        versions, machine, commit; times of different ``host`` are never compared
``rows``              one for each estimator, the best score first:

    ``estimator, title, family, is_baseline, params, chosen``     what answered; `family` groups kindred ones
    ``looks_at``                features, the time of a sample, or nothing
    ``status, reason``          done, or skipped or failed and why
    ``score, ci_low, ci_high, ci_method``      of the cell, over all folds
    ``search_s``                of the cell: choosing hyper-parameters
    ``n_train, n_test, n_features``            of the timed fold
    ``fit_s, fit_s_q1, fit_s_q3, fits``        median and quartiles of so many fits
    ``batch_s_per_row, …_q1, …_q3, batches``   all test rows in one call, by row: median and quartiles
    ``latency_ms_p50, latency_ms_p95, latency_ms_q1, latency_ms_q3, latency_n``    single rows, quantiles of all calls
    ``latency_ms_max``          the largest of them; fewer than 200 calls have no p95
    ``answer_delay_ms, …_q1, …_q3``            from a change at the skin to the answer: median and quartiles
    ``delay_parts_ms``          what it is the sum of: ``sampling, link, window, features, prediction``
    ``data_s, data_kind``       seconds that the training recordings took, ``simulated`` or ``acquired``
    ``loop_100_hz, loop_1000_hz``      whether the answer delay is below the period, features and prediction
                                taken at their p95 (of fewer than 200 calls the largest)
    ``front_fit, front_delay``  whether nobody is both better and quicker; baselines do not compete, nor
                                who is no better than the best of them that looks at nothing
    ``notes``                   what a reader of the row must know
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tactbench.core.cost.ladder import Ladder
from tactbench.core.errors import UnwritableError
from tactbench.core.files import replace_file

VERSION = 2

DEFINITIONS = {
    "fit_s": "seconds of one fit on the training rows of one fold, with parameters chosen and features ready; median "
    "of the rounds",
    "batch_s_per_row": "seconds of one predict over all test rows of the fold, divided by their number; median of the "
    "rounds",
    "latency_ms": "milliseconds of predict on a single row whose features are ready, after warm-up; quantiles of the "
    "calls of all rounds",
    "data_s": "seconds that it took to record the training recordings: the processor's for simulated ones, else the "
    "wall's",
    "answer_delay_ms": "milliseconds from a change at the skin to the answer that knows of it: one sampling interval "
    "of the sensor, its link, the group delay of the window, features and prediction of one row (medians)",
    "loop": "an answer keeps up with a loop on this machine if its delay is below the loop's period (10 ms at 100 Hz, "
    "1 ms at 1 kHz), features and prediction taken at their p95 or, of fewer than 200 calls, the largest; the part in "
    "brackets is the longest",
    "front": "nobody else is both better by the score itself and quicker; trivial answers do not compete, nor what is "
    "no better than the best of them that looks at nothing; scores whose "
    "intervals overlap may be told apart by luck",
}


def stem(folder: Path, sensor: str, task: str) -> Path:
    """Return where the ladder of a sensor and a task lies in the result folder, without the ending."""
    return folder / "cost" / f"{sensor}-{task}"


def write_ladder(ladder: Ladder, folder: Path, metric: str = "") -> list[Path]:
    """Write a ladder's four files into the result folder, each whole or not at all; return their paths.

    `metric` is the score's name for people, in the figure.

    Raises
    ------
    UnwritableError
        If the folder cannot be written.
    """
    from tactbench.core.cost.ladder_figure import draw_ladder

    place = stem(folder, ladder.about["sensor"], ladder.about["task"])
    whole = {"version": VERSION, **ladder.about, "definitions": DEFINITIONS, "rows": ladder.rows}
    paths = [place.with_name(f"{place.name}.{ending}") for ending in ("json", "csv", "png", "pdf")]
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        replace_file(paths[0], text.encode())
        replace_file(paths[1], flat_csv(ladder).encode())
        draw_ladder(ladder, paths[2:], metric)
    except OSError as error:
        raise UnwritableError(
            f"{place.parent} cannot be written: {error}.", hint="Give another folder with --out."
        ) from error
    return paths


def flat_csv(ladder: Ladder) -> str:
    """Return the rows as CSV: what is a list or a mapping in them as JSON."""
    import csv
    import io

    out = io.StringIO()
    writer = csv.DictWriter(out, fieldnames=list(ladder.rows[0]), lineterminator="\n")
    writer.writeheader()
    for row in ladder.rows:
        writer.writerow({
            key: json.dumps(value, ensure_ascii=False) if isinstance(value, dict | list) else value
            for key, value in row.items()
        })  # fmt: skip
    return out.getvalue()


def read_ladders(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield the tables of a result folder, by name of file; a file that is none of this version is left out."""
    for path in sorted((folder / "cost").glob("*.json")):
        try:
            found = json.loads(path.read_bytes())
        except (OSError, ValueError):
            continue
        if isinstance(found, dict) and found.get("version") == VERSION and isinstance(found.get("rows"), list):
            yield found

"""``tactbench why``: what a score rests on, how a cell ended, whether it would be reused; its recomputation."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import RESULTS, format_option
from tactbench.core.tables.text import command_line, json_text, visible_lines

if TYPE_CHECKING:
    from tactbench.core.matrix.store import Row
    from tactbench.core.matrix.why import StoredCell

Field = tuple[str, str]
"""A name, and a text of the value with its unit."""
_TAIL = 15
"""Lines of a traceback or log that are shown; JSON has all of them."""
_FIELDS = 12
"""Fields of one kind (recordings, reasons) that are shown; JSON has all of them."""


@click.command(name="why")
@click.argument("cell", metavar="CELL")
@RESULTS
@click.option("--again", is_flag=True, help="Compute the cell again and compare it, bit for bit; changes nothing.")
@format_option("text", "json")
@click.pass_context
def command(ctx: click.Context, cell: str, out: Path, again: bool, shape: str) -> None:
    """Show what a cell's score rests on, whether its result would be reused, and how it ended.

    CELL is a name as tables show it, or a part of it that only one cell has; the first of its replicates is meant. With
    --again, simulated recordings are made anew in a temporary folder, and the exit code is 1 if a result differs or the
    cell fails.
    """
    from tactbench.core.cli.grid import print_fields
    from tactbench.core.matrix.why import stored_cell
    from tactbench.core.study.results import opened

    found = stored_cell(opened(out), cell)
    facts = _again(found) if again else _facts(found)
    if shape == "json":
        click.echo(json_text(facts, indent=1))
    else:
        print_fields([(name, text) for name, text in (_again_fields if again else _fields)(facts) if text])
        for part in ("traceback", "log"):
            if lines := (facts.get(part) or "").splitlines():
                click.echo(visible_lines("\n  ".join([f"{part}, last lines:", *lines[-_TAIL:]])))
        if not again:
            click.echo(visible_lines(f"\nTry: {facts['try']}"))
    ctx.exit(1 if again and facts["answer"] != "identical" else 0)


def _facts(found: StoredCell) -> dict[str, Any]:
    from tactbench.core.report.cells import recording_scores

    row, name = found.row, found.cell.name
    key, reasons = found.changes()
    done = row["status"] == "done"
    scores = recording_scores(row, found.store.answers(str(row["key"])).get("test")) if done else []
    return {
        "cell": name,
        "answer": "hit" if done and not reasons else "miss",
        "key": key,
        "reasons": reasons,
        **{fact: row.get(fact) for fact in ("status", "reason", "signal", "traceback", "log")},
        "file": str(found.store.folder / "cells" / f"{row['key']}.h5") if done else None,
        "recordings": list(row["recordings"]) if done else [],
        "simulation": row["simulation"],
        "replicates": [*_replicates(found)] if done else [],
        "rests_on": [*_rests_on(row)] if done else [],
        "left_out": row["counts"],
        "recording_scores": {one["recording"]: one["score"] for one in scores},
        "try": command_line("tactbench", "why", name, "--again", "--out", str(found.store.folder)),
    }


def _replicates(found: StoredCell) -> Iterator[Field]:
    """Yield the scores and times of the cell over its replicates, and the score of each of them."""
    from tactbench.core.leaderboard.names import metric_name
    from tactbench.core.statistics.replicates import counted, over_replicates, percent
    from tactbench.core.tables.numbers import delay, duration, interval, score_with_unit

    name = found.cell.name.removesuffix(f"/{found.cell.seed}")
    (row,) = over_replicates([row for row in found.store.rows() if row["cell"].rpartition("/")[0] == name])
    unit, many, of = str(row["unit"]), row["n_replicates"], str(row["replicate_unit"])
    yield metric_name(row), f"{score_with_unit(row['score'], unit)} over {counted(many, of)}"
    if row["ci_low"] is not None:
        ends = interval(row["ci_low"], row["ci_high"], unit)
        yield f"{percent(many, of)} interval", f"{ends} {row['ci_method']}"
    for name in ("score_beyond_floor", "reference_floor", "reference_floor_se", "reference_score", "published"):
        if row.get(name) is not None:
            yield name.replace("_", " "), score_with_unit(row[name], unit)
    kept = found.row["replicates"]
    own = zip(kept["names"], kept["own"], strict=True) if of != "replicate" else ()
    for label, value in own or zip((f"seed {seed}" for seed in row["seeds"]), row["replicate_scores"], strict=True):
        yield f"score, {label}" if of == "replicate" else f"score, {of} {label}", score_with_unit(value, unit)
    if row["delay_parts_ms"] and row["answer_delay_ms"] is not None:
        yield "delay after touch", delay(row["answer_delay_ms"], row["delay_parts_ms"])
        yield from ((f"  {part}", duration(value / 1e3)) for part, value in row["delay_parts_ms"].items())


def _rests_on(row: Row) -> Iterator[Field]:
    """Yield the metrics, samples, recordings and assumptions behind the score of a finished replicate."""
    from tactbench.core.cli.grid import field_text
    from tactbench.core.leaderboard.names import metric_name
    from tactbench.core.tables.numbers import score_with_unit

    yield metric_name(row), score_with_unit(row["score"], str(row["unit"]))
    yield from ((name, f"{value:.3g}") for name, value in {**row["scores"], **(row.get("events") or {})}.items())
    if row.get("chosen"):
        yield "chosen on validation data", field_text(row["chosen"])
    yield "samples to train on, all folds together", str(row["n_train"])
    yield "samples to test on", str(row["n_test"])
    yield "recordings", f"{row['n_recordings']} of {row['n_sessions']} sessions"
    yield from (("assumed", f"{name} {value}") for name, value in sorted((row.get("assumptions") or {}).items()))
    yield from (("found", str(text)) for text in row.get("findings", ()))
    yield from (("remark", str(remark)) for remark in (*row.get("remarks", ()), *row.get("stamps", ())))


def _fields(facts: dict[str, Any]) -> Iterator[Field]:
    """Yield the facts about a cell as fields of a screen."""
    yield from (("cell", facts["cell"]), ("status", facts["status"]), ("reason", facts["reason"] or ""))
    yield "signal", str(facts["signal"] or "")
    yield "tactbench run", "reuses it" if facts["answer"] == "hit" else "computes it again"
    yield from facts["replicates"]
    if facts["rests_on"]:
        yield "this replicate", facts["file"]
        yield from ((f"  {name}", value) for name, value in facts["rests_on"])
    counts = sorted(facts["left_out"].items(), key=lambda one: -one[1])
    several = {
        "changed": facts["reasons"], "left out": [f"{count} {what}" for what, count in counts],
        "test recordings": [f"{value:.4g} of {name}" for name, value in facts["recording_scores"].items()],
        "recordings": facts["recordings"],
    }  # fmt: skip
    for name, texts in several.items():
        more = [f"… {len(texts) - _FIELDS} more"] if len(texts) > _FIELDS else []
        yield from zip([f"{name} ({len(texts)})", *[""] * _FIELDS], [*texts[:_FIELDS], *more], strict=False)


def _again(found: StoredCell) -> dict[str, Any]:
    """Compute the cell again in this process, and return how it compares."""
    from tactbench.core.study.progress import progress

    with redirect_stdout(sys.stderr), progress() as display:  # what a plugin prints is no result
        row, differences, recorded = found.again(display)
    return {
        "cell": found.cell.name,
        "answer": "identical" if row["status"] == "done" and not differences else "different",
        "recordings_made": recorded,
        **{name: row[name] for name in ("status", "reason", "traceback", "score")},
        "differences": differences,
        "circumstances": found.changes()[1],
    }


def _again_fields(facts: dict[str, Any]) -> Iterator[Field]:
    yield from (("cell", facts["cell"]), ("answers, scores, intervals", facts["answer"]), ("status", facts["status"]))
    yield from (("reason", facts["reason"]), ("recordings made", str(facts["recordings_made"])))
    yield from (("differs", text) for text in facts["differences"])
    yield from (("changed since", text) for text in facts["circumstances"])

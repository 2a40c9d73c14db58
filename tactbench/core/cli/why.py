"""``tactbench why``: whether a result would be reused, what changed, what it is made of, how it ended otherwise."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import options
from tactbench.core.cli.selection import SELECTING
from tactbench.core.cli.threads import keep_threads
from tactbench.core.tables.text import json_text, visible

if TYPE_CHECKING:
    from tactbench.core.cli.cells import StoredCell
    from tactbench.core.matrix.store import Row
    from tactbench.core.matrix.why import Explanation

_TAIL = 15
"""Lines of a traceback or log that are shown; the whole of it stands in ``--format json``."""
_REASONS = 20


@click.command(name="why")
@click.argument("cell", metavar="CELL")
@click.option("--out", type=click.Path(path_type=Path), default=Path("tactbench-results"), show_default=True,
              metavar="DIR", help="The result folder.")  # fmt: skip
@options(*SELECTING)
@click.option("--format", "shape", type=click.Choice(("text", "json")), default="text", show_default=True)
def command(cell: str, out: Path, shape: str, **options: Any) -> None:
    """Say why a cell would be reused or computed, what its score rests on, and how it ended.

    CELL is its name as tables show it, or a part that only one cell has; of the replicates of a
    cell the first is meant. Without options the cell is asked for as it was; with `run`'s options, as they ask for it.
    """
    keep_threads()
    from tactbench.core.cli.cells import find_cell

    found = find_cell(out, cell, options)
    facts = _facts(found, found.explain())
    click.echo(json_text(facts, indent=1) if shape == "json" else _text(facts))


def _facts(found: StoredCell, why: Explanation) -> dict[str, Any]:
    row = found.row or {}
    folder = found.store.folder
    key = str(row.get("key") or "")
    done = row.get("status") == "done"
    return {
        "cell": found.cell.name,
        "answer": "hit" if why.hit else "miss",
        "key": why.key,
        "reasons": list(why.reasons),
        "status": row.get("status", "never run"),
        "reason": row.get("reason", ""),
        "signal": row.get("signal"),
        "traceback": row.get("traceback", ""),
        "log": row.get("log", ""),
        "stored_key": key,
        "file": str(folder / "cells" / f"{key}.h5") if done else None,
        "recordings": list(row.get("recordings", [])) if done else [],
        "simulation": row.get("simulation", {}),
        "score": row.get("score"),
        "made_by": row.get("made_by", ""),
        "replicates": _replicates(found) if done else [],
        "rests_on": _rests_on(row) if done else [],
        "provenance": _provenance(found) if done else [],
        "try": _try(found, why),
    }


def _replicates(found: StoredCell) -> list[str]:
    """Return what the cell came to over its replicates, and what each of them scored."""
    from tactbench.core.leaderboard.names import metric_name
    from tactbench.core.statistics.replicates import counted, over_replicates, percent
    from tactbench.core.tables.numbers import ABSENT, interval, score

    name = found.cell.name.removesuffix(f"/{found.cell.repeat}")
    (row,) = over_replicates([row for row in found.store.rows() if row["cell"].rpartition("/")[0] == name])
    unit, many = str(row["unit"]), row["n_replicates"]
    ends = interval(row["ci_low"], row["ci_high"], unit)
    over = counted(many, str(row["replicate_unit"]))
    text = f"{metric_name(row)} {score(row['score'], unit)}"
    text += (
        f", {percent(many, row['replicate_unit'])} over {over}: {ends}" if ends != ABSENT else f" ({over}: no interval)"
    )
    if row["score_beyond_floor"] is not None:
        ends = interval(row["beyond_floor_ci_low"], row["beyond_floor_ci_high"], unit)
        text += f"; beyond the floor {score(row['score_beyond_floor'], unit)}" + (f", {ends}" if ends != ABSENT else "")
    parts = [text]
    if len(row["replicate_scores"]) > 1:
        each = zip(row["seeds"], row["replicate_scores"], strict=True)
        parts.append("each (seed: score): " + ", ".join(f"{seed}: {score(value, unit)}" for seed, value in each))
    if row["recordings_right"] is not None:
        parts.append(f"recordings right: {row['recordings_right']:.3g} of {row['recordings_asked']:.3g} a replicate")
    if row["delay_parts_ms"] and row["answer_delay_ms"] is not None:
        listed = ", ".join(f"{part} {value:.3g}" for part, value in row["delay_parts_ms"].items())
        parts.append(f"answer delay {row['answer_delay_ms']:.3g} ms: {listed}")
    return [visible(part) for part in parts]


def _rests_on(row: Row) -> list[str]:
    """Return what the score of a finished cell is made of and what it is to be held against."""
    from tactbench.core.leaderboard.names import metric_name
    from tactbench.core.leaderboard.notes import count_texts, picked
    from tactbench.core.tables.numbers import score, score_with_unit

    unit = str(row["unit"])
    texts = [f"{metric_name(row)} {score(row['score'], unit)}"]
    if row.get("score_beyond_floor") is not None:
        floor = f"floor of the reference {score_with_unit(row['reference_floor'], unit)}"
        texts += [floor, f"beyond it {score(row['score_beyond_floor'], unit)}"]
    if row.get("published") is not None:
        texts.append(f"published {score(row['published'], unit)} ({row['published_reference']})")
    parts = [("score", "; ".join(texts))]
    if row.get("scores"):
        parts.append(("other scores", ", ".join(f"{name} {value:.3g}" for name, value in row["scores"].items())))
    if row.get("events"):
        parts.append(("events", ", ".join(f"{name} {value:.3g}" for name, value in row["events"].items())))
        parts.append(("alarms", str(row["answer_from"])))
    if row.get("chosen"):
        parts.append(("chosen on validation data", picked(row)))
    parts.append(("samples", f"{row['n_train']} to train on, {row['n_test']} to test on, from {row['n_recordings']} "
                             f"recordings of {row['n_sessions']} sessions"))  # fmt: skip
    if row.get("assumptions"):
        parts.append(("assumed", ", ".join(f"{name} {value}" for name, value in sorted(row["assumptions"].items()))))
    counted = count_texts(row.get("counts") or {})
    if counted:
        parts.append(("left out", "; ".join(counted)))
    parts += [("remark", str(remark)) for remark in (*row.get("remarks", ()), *row.get("stamps", ()))]
    return [visible(f"{name}: {text}") for name, text in parts]


def _provenance(found: StoredCell) -> list[str]:
    from tactbench.core.cli.results import provenance_of
    from tactbench.core.provenance.gather import foot

    return list(foot(provenance_of(found.store, [found.row or {}])))


def _try(found: StoredCell, why: Explanation) -> str:
    if found.row is None or (not why.hit and found.row["status"] == "done"):
        return "tactbench run: computes it"
    from tactbench.core.tables.text import command_line

    return command_line("tactbench", "rerun", found.cell.name, "--out", str(found.store.folder))


def _text(facts: dict[str, Any]) -> str:
    lines = [facts["cell"]]
    if facts["answer"] == "hit":
        lines.append("hit: nothing that decides the result has changed; `tactbench run` uses it again.")
    elif facts["status"] == "done":
        lines.append("miss: `tactbench run` computes it again.")
    else:
        lines.append("miss: there is no result to use again; `tactbench run` computes it.")
    lines += [f"  {reason}" for reason in facts["reasons"][:_REASONS]]
    if len(facts["reasons"]) > _REASONS:
        lines.append(f"  and {len(facts['reasons']) - _REASONS} more (--format json has all)")
    lines += ["", *_ended(facts), "", f"Try: {facts['try']}"]
    return "\n".join(lines)


def _ended(facts: dict[str, Any]) -> list[str]:
    if facts["status"] == "done":
        where = ", ".join(facts["recordings"][:3])
        more = len(facts["recordings"]) - 3
        recordings = f"{where}{f' and {more} more' if more > 0 else ''}"
        over = [f"over replicates: {facts['replicates'][0]}", *(f"  {part}" for part in facts["replicates"][1:])]
        one = ["this replicate:", *(f"  {part}" for part in facts["rests_on"])]
        return [*over, *one, f"done: {facts['file']}", f"recordings: {recordings}", *facts["provenance"]]
    lines = [facts["status"] + (f": {facts['reason']}" if facts["reason"] else "")]
    if facts["signal"] is not None:
        lines.append(f"signal {facts['signal']}")
    for part in ("traceback", "log"):
        shown = facts[part].splitlines()
        if shown:
            lines.append(f"{part}{', its end' if len(shown) > _TAIL else ''}:")
            lines += [f"  {line}" for line in shown[-_TAIL:]]
    return lines

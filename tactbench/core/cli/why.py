"""``tactbench why``: what a score rests on, whether it would be reused, how a cell ended, and the same once more."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import RESULTS, format_option
from tactbench.core.cli.threads import keep_threads
from tactbench.core.tables.text import command_line, json_text, visible, visible_lines

if TYPE_CHECKING:
    from tactbench.core.cli.cells import StoredCell
    from tactbench.core.matrix.store import Row

Field = tuple[str, str]
"""A name, and a value with its unit."""
_TAIL = 15
"""Lines of a traceback or log that are shown; the whole of it stands in ``--format json``."""
_FIELDS = 12
"""Fields of one kind (recordings, reasons, counts) that are shown; the others stand in ``--format json``."""


@click.command(name="why")
@click.argument("cell", metavar="CELL")
@RESULTS
@click.option("--again", is_flag=True, help="Compute the cell again and compare it, bit for bit; changes nothing.")
@format_option("text", "json")
@click.pass_context
def command(ctx: click.Context, cell: str, out: Path, again: bool, shape: str) -> None:
    """Show what a cell's score rests on, whether its result would be reused, and how it ended.

    CELL is a name as tables show it, or a part of it that only one cell has; of its replicates the first is meant. With
    --again, the exit code is 1 if something differs or it fails. What a simulation recorded is then recorded again,
    into another place.
    """
    keep_threads()
    from tactbench.core.cli.cells import find_cell

    found = find_cell(out, cell)
    facts = _repeated(found) if again else _facts(found)
    text = json_text(facts, indent=1) if shape == "json" else (_again_text if again else _text)(facts)
    click.echo(text)
    ctx.exit(1 if again and facts["answer"] != "identical" else 0)


def _facts(found: StoredCell) -> dict[str, Any]:
    row, why = found.row, found.explain()
    done = row["status"] == "done"
    again = () if done and not why.hit else ("why", found.cell.name, "--again", "--out", str(found.store.folder))
    return {
        "cell": found.cell.name,
        "answer": "hit" if why.hit else "miss",
        "key": why.key,
        "reasons": list(why.reasons),
        **{name: row.get(name) for name in ("status", "reason", "signal", "traceback", "log", "score", "made_by")},
        "stored_key": str(row["key"] or ""),
        "file": str(found.store.folder / "cells" / f"{row['key']}.h5") if done else None,
        "recordings": list(row["recordings"]) if done else [],
        "simulation": row["simulation"],
        "replicates": [*_replicates(found)] if done else [],
        "scores": row["scores"] if done else {},
        "recording_scores": _recording_scores(found) if done else {},
        "rests_on": [*_rests_on(row)] if done else [],
        "provenance": _provenance(found) if done else [],
        "try": command_line("tactbench", *(again or ("run",))),
    }


def _replicates(found: StoredCell) -> Iterator[Field]:
    """Yield what the cell came to over its replicates, and what each of them scored."""
    from tactbench.core.statistics.replicates import counted, over_replicates, percent
    from tactbench.core.tables.numbers import ABSENT, interval, score_with_unit

    name = found.cell.name.removesuffix(f"/{found.cell.repeat}")
    (row,) = over_replicates([row for row in found.store.rows() if row["cell"].rpartition("/")[0] == name])
    unit, many = str(row["unit"]), row["n_replicates"]
    over = counted(many, str(row["replicate_unit"]))
    yield "score", f"{score_with_unit(row['score'], unit)} over {over}"
    ends = interval(row["ci_low"], row["ci_high"], unit)
    share = percent(many, row["replicate_unit"])
    yield f"{share} interval", "none: fewer than five" if ends == ABSENT else f"{ends} ({row['ci_method']})"
    if row["score_beyond_floor"] is not None:
        ends = interval(row["beyond_floor_ci_low"], row["beyond_floor_ci_high"], unit)
        beyond = score_with_unit(row["score_beyond_floor"], unit)
        yield "score beyond the floor", beyond if ends == ABSENT else f"{beyond}, {ends}"
    if len(row["replicate_scores"]) > 1:
        for seed, value in zip(row["seeds"], row["replicate_scores"], strict=True):
            yield f"score, seed {seed}", score_with_unit(value, unit)
    if row["recordings_right"] is not None:
        yield "recordings right", f"{row['recordings_right']:.3g} of {row['recordings_asked']:.3g} a replicate"
    if row["delay_parts_ms"] and row["answer_delay_ms"] is not None:
        yield "delay after touch", f"{row['answer_delay_ms']:.3g} ms"
        yield from ((f"  {part}", f"{value:.3g} ms") for part, value in row["delay_parts_ms"].items())


def _recording_scores(found: StoredCell) -> dict[str, float]:
    """Return the score of each test recording, of classes the accuracy; none of events."""
    from tactbench.core.report.cells import recording_scores

    scores = recording_scores(found.row, found.store.answers(str(found.row["key"])).get("test"))
    return {name: value for name, _, value in map(dict.values, scores)}


def _rests_on(row: Row) -> Iterator[Field]:
    """Yield what the score of a finished cell is made of and what it is to be compared with."""
    from tactbench.core.leaderboard.names import metric_name
    from tactbench.core.leaderboard.notes import count_texts, picked
    from tactbench.core.tables.numbers import score_with_unit

    unit = str(row["unit"])
    yield "metric", metric_name(row)
    yield "score", score_with_unit(row["score"], unit)
    if row.get("score_beyond_floor") is not None:
        yield "floor of the reference", score_with_unit(row["reference_floor"], unit)
        yield "score beyond the floor", score_with_unit(row["score_beyond_floor"], unit)
    if row.get("published") is not None:
        yield "published", f"{score_with_unit(row['published'], unit)} ({row['published_reference']})"
    yield from ((name, f"{value:.3g}") for name, value in (row.get("scores") or {}).items())
    if row.get("events"):
        yield from ((name, f"{value:.3g}") for name, value in row["events"].items())
        yield "alarms", str(row["answer_from"])
    if row.get("chosen"):
        yield "chosen on validation data", picked(row)
    yield "samples to train on", str(row["n_train"])
    yield "samples to test on", str(row["n_test"])
    yield "recordings", f"{row['n_recordings']} of {row['n_sessions']} sessions"
    yield from (("assumed", f"{name} {value}") for name, value in sorted((row.get("assumptions") or {}).items()))
    yield from (("left out", text) for text in count_texts(row.get("counts") or {}))
    yield from (("remark", str(remark)) for remark in (*row.get("remarks", ()), *row.get("stamps", ())))


def _provenance(found: StoredCell) -> list[str]:
    from tactbench.core.cli.results import provenance_of
    from tactbench.core.provenance.gather import foot

    return list(foot(provenance_of(found.store, [found.row])))


def _text(facts: Mapping[str, Any]) -> str:
    done = facts["status"] == "done"
    fields: list[Field] = [("status", f"{facts['status']}{': ' if facts['reason'] else ''}{facts['reason']}")]
    if facts["signal"] is not None:
        fields.append(("signal", str(facts["signal"])))
    will = "reuses" if facts["answer"] == "hit" else "computes it again, for what changed:" if done else "computes it"
    fields.append(("tactbench run", f"{will} it" if will == "reuses" else will))
    fields += _first([("", text) for text in facts["reasons"]])
    if done:
        per = _first([(f"  {name}", f"{value:.4g}") for name, value in facts["recording_scores"].items()])
        fields += [("", ""), *facts["replicates"], ("", ""), ("this replicate", facts["cell"]), *facts["rests_on"]]
        fields += [("score of recording", ""), *per] if per else []
        fields += [("", ""), ("file", facts["file"])]
        fields += _first([("recording", path) for path in facts["recordings"]])[:4]
        fields += [("made by", text) for text in facts["provenance"]]
    lines = [facts["cell"], *_aligned(fields)]
    for part in ("traceback", "log"):
        shown = (facts[part] or "").splitlines()
        if shown:
            lines.append(f"{part}{', its end' if len(shown) > _TAIL else ''}:")
            lines += [f"  {line}" for line in shown[-_TAIL:]]
    return visible_lines("\n".join([*lines, "", f"Try: {facts['try']}"]))


def _first(fields: list[Field]) -> list[Field]:
    more = len(fields) - _FIELDS
    return fields if more <= 0 else [*fields[:_FIELDS], ("", f"and {more} more (--format json has all)")]


def _aligned(fields: list[Field]) -> list[str]:
    width = max(len(name) for name, _ in fields)
    return [visible(f"{name:<{width}}  {value}".rstrip()) for name, value in fields]


def _repeated(found: StoredCell) -> dict[str, Any]:
    """Compute the cell again in this process, and return how it compares."""
    from tactbench.core.cli.progress import progress
    from tactbench.core.cli.screen import remark
    from tactbench.core.matrix.rerun import compute_again

    row = found.row
    if row.get("signal") is not None:
        remark(f"It was ended by signal {row['signal']} before; it is computed in this process now.")
    paths = () if found.simulated else found.paths
    with redirect_stdout(sys.stderr), progress() as display:  # what a plugin prints is no result
        again = compute_again(found.cell, row, found.store, found.registry, paths, display)
    return {
        "cell": found.cell.name,
        "answer": "identical" if again.identical else "different",
        "recordings_made": again.recordings,
        **{name: again.row[name] for name in ("status", "reason", "traceback", "score")},
        "differences": list(again.differences),
        "circumstances": list(found.explain().reasons),
    }


def _again_text(facts: Mapping[str, Any]) -> str:
    lines = [facts["cell"]]
    if facts["answer"] == "identical":
        made = f"{facts['recordings_made']} recordings, " if facts["recordings_made"] else ""
        lines.append(f"identical: {made}answers, scores and intervals, bit for bit.")
    else:
        lines.append("different:" if facts["differences"] else f"{facts['status']} again, as before: {facts['reason']}")
        lines += [f"  {line}" for line in (*facts["differences"], *facts["traceback"].splitlines())]
    if facts["circumstances"]:
        lines += ["Since the cell was made, this has changed:", *(f"  {reason}" for reason in facts["circumstances"])]
    return visible_lines("\n".join(lines))

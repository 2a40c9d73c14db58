"""What the page opens with, what came out; and what it ends with: of what it was made, where, what is simulated."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from tactbench.core.provenance.source import RELEVANT
from tactbench.core.report.figures.published_and_ours import COLUMN
from tactbench.core.report.figures.published_and_ours import NAME as PUBLISHED
from tactbench.core.report.published import reproduce
from tactbench.core.report.section import Highlight, Picture, ReportData, Section, block_anchor
from tactbench.core.tables.numbers import score
from tactbench.core.tables.text_table import Entry, TextTable, text_table

_FACTS = ("tactbench", "commit", "python", "platform", "machine", "cpu", "cores", "host", "jobs")


MOST_TASKS = 2
"""So many tasks are named in the first section; the leaderboards have them all."""


def answers_section(subject: ReportData) -> Section:
    """Return the first section: published scores and ours in one picture, and what came out in three sentences."""
    drawn = {one.name: one for one in subject.drawn}
    pictures: tuple[Picture, ...] = ()
    if PUBLISHED in drawn and COLUMN in drawn:
        one = drawn[PUBLISHED]
        pictures = (Picture(one.title, one.caption, one.png.read_bytes(), narrow=drawn[COLUMN].png.read_bytes()),)
    answers = [*_published(subject), *_tasks(subject)]
    simulated = sum(bool(row["simulated"]) for row in subject.rows if row["status"] == "done")
    paragraphs = ("SIM: simulated by a twin of the sensor; no sensor was pressed.",) if simulated else ()
    return Section("answers", "What came out", paragraphs=paragraphs, pictures=pictures, answers=tuple(answers))


def _published(subject: ReportData) -> list[Highlight]:
    """Return how many published numbers lie in the interval of ours."""
    found = reproduce(subject.results.registry, subject.rows)
    lines = [one for one in found if one.row is not None and one.row["status"] == "done"]
    if not lines:
        return []
    with_interval = [one for one in lines if one.verdict != "no interval"]
    if not with_interval:
        few = f"Published numbers beside ours: {len(lines)}; ours are of too few replicates for an interval."
        return [Highlight(few, "reproduction", "published numbers and ours")]
    inside = sum(one.verdict == "inside" for one in with_interval)
    sentence = f"Published numbers in the 95 % interval of ours: {inside} of {len(with_interval)}"
    outside = [
        f"{one.title} (published {score(one.published, one.unit)}, ours {score(one.row['score'], one.unit)})"
        for one in with_interval
        if one.row is not None and one.verdict == "outside"
    ]
    sentence += f"; outside: {', '.join(outside)}." if outside else "."
    return [Highlight(sentence, "reproduction", "published numbers and ours")]


def _tasks(subject: ReportData) -> list[Highlight]:
    """Return what the first table of each task comes to, without how finely it resolves."""
    found: dict[str, Highlight] = {}
    for place, block in enumerate(subject.leaderboard.blocks):
        row = block.lines[0].row
        if not block.verdict or row["task"] in found:
            continue
        sentence = (*block.verdict[:1], *(one for one in block.verdict[2:] if not one.startswith(PUBLISHED)))
        question = f"{row['task']} under {row['protocol']}{' †' if row['dagger'] else ''}"
        question += ", SIM" if row["simulated"] else ""
        found[row["task"]] = Highlight(
            f"{question}: {' '.join(sentence)}", block_anchor(place), f"table of {row['task']}"
        )
    return list(found.values())[:MOST_TASKS]


def about_section(subject: ReportData) -> Section:
    """Return the last section."""
    counts = Counter(str(row["status"]) for row in subject.rows)
    statuses = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    seeds = ", ".join(map(str, sorted({seed for row in subject.rows for seed in row.get("seeds") or [row["seed"]]})))
    paragraphs = [
        "Each number on this page links to the cell that it is from, with everything that is known about it.",
        f"{len(subject.rows)} cells: {statuses}. Seeds: {seeds}.",
    ]
    facts = _facts(subject)
    if facts:
        paragraphs.append(_made_by(facts))
    tables = [_table("Made with and on (the last run)", facts, _FACTS)] if facts else []
    versions = facts.get("distributions")
    if isinstance(versions, dict):
        tables.append(_table("Versions of everything installed then", versions, sorted(versions)))
    lacks = "Versions and host are not known: the results have no run.json; `tactbench run` writes one."
    return Section(
        "about",
        "What this was made of",
        paragraphs=(*paragraphs, *_simulated(subject)),
        tables=tuple(tables),
        missing=() if facts else (lacks,),
    )


def _facts(subject: ReportData) -> dict[str, Any]:
    try:
        facts = json.loads((subject.folder / "run.json").read_bytes())
    except (OSError, ValueError):
        return {}
    return facts if isinstance(facts, dict) else {}


def _made_by(facts: dict[str, Any]) -> str:
    """Return in one sentence what ran, on what."""
    installed = facts.get("distributions")
    versions = [f"Python {facts.get('python', '?')}"]
    if isinstance(installed, dict):
        versions += [f"{name} {installed[name]}" for name in RELEVANT if name in installed]
    commit = f" (commit {facts['commit']})" if facts.get("commit") else ""
    host = ", ".join(str(facts[name]) for name in ("cpu", "platform") if facts.get(name))
    return (
        f"Last run with tactbench {facts.get('tactbench', '?')}{commit}, {', '.join(versions)}; on {host}, "
        f"{facts.get('cores', '?')} cores, {facts.get('jobs', '?')} at work. Times are of that host."
    )


def _table(title: str, facts: dict[str, Any], names: Any) -> TextTable:
    return text_table(title, ("", "value"), [(name, Entry(str(facts[name]))) for name in names if facts.get(name)])


def _simulated(subject: ReportData) -> list[str]:
    """Return what is simulated, and under which assumptions; cells with the same ones share a sentence."""
    by_assumptions: dict[str, list[str]] = {}
    for row in subject.rows:
        if row["simulated"]:
            assumed = ", ".join(f"{name} {value}" for name, value in sorted(row["assumptions"].items()))
            by_assumptions.setdefault(assumed, []).append(f"{row['sensor']}/{row['task']}")
    if not by_assumptions:
        return []
    paragraphs = [
        "SIM: rows so marked are simulated by a twin of the sensor. No sensor was pressed; they say what the model "
        "behind them implies, and are never ranked against hardware."
    ]
    for assumed, whose in by_assumptions.items():
        named = ", ".join(dict.fromkeys(whose))
        paragraphs.append(f"Assumed for {named}: {assumed or 'nothing that its recordings state'}.")
    return paragraphs

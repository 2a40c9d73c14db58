"""What the page is: of what it was made, where, and what is simulated."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

from tactbench.core.matrix.keys import RELEVANT
from tactbench.core.report.plain import Entry, PlainTable, plain
from tactbench.core.report.section import Section, Subject

_FACTS = ("tactbench", "commit", "python", "platform", "machine", "cpu", "cores", "host", "jobs")


def opening(subject: Subject) -> Section:
    """Return the first section."""
    counts = Counter(str(row["status"]) for row in subject.rows)
    told = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    seeds = ", ".join(str(seed) for seed in sorted({row["seed"] for row in subject.rows}))
    said = [
        "How good are the answers of tactile sensors, and what do they cost in time? Each number below links to the "
        "cell that it is from, with everything that is known about it.",
        f"{len(subject.rows)} cells: {told}. Seed: {seeds}.",
    ]
    facts = _facts(subject)
    if facts:
        said.append(_made_by(facts))
    tables = [_table("Made with and on (the last run)", facts, _FACTS)] if facts else []
    versions = facts.get("distributions")
    if isinstance(versions, dict):
        tables.append(_table("Versions of everything installed then", versions, sorted(versions)))
    lacks = "Versions and host are not known: the results have no run.json; `tactbench run` writes one."
    return Section(
        "about",
        "What this is",
        said=(*said, *_simulated(subject)),
        tables=tuple(tables),
        missing=() if facts else (lacks,),
    )


def _facts(subject: Subject) -> dict[str, Any]:
    try:
        facts = json.loads((subject.folder / "run.json").read_text(encoding="utf-8"))
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


def _table(title: str, facts: dict[str, Any], names: Any) -> PlainTable:
    return plain(title, ("", "value"), [(name, Entry(str(facts[name]))) for name in names if facts.get(name)])


def _simulated(subject: Subject) -> list[str]:
    """Return what is simulated, and under which assumptions; cells with the same ones share a sentence."""
    by_assumptions: dict[str, list[str]] = {}
    for row in subject.rows:
        if row["simulated"]:
            assumed = ", ".join(f"{name} {value}" for name, value in sorted(row["assumptions"].items()))
            by_assumptions.setdefault(assumed, []).append(f"{row['sensor']}/{row['task']}")
    if not by_assumptions:
        return []
    said = [
        "SIM: rows so marked are simulated by a twin of the sensor. No sensor was pressed; they say what the model "
        "behind them implies, and are never ranked against hardware."
    ]
    for assumed, whose in by_assumptions.items():
        named = ", ".join(dict.fromkeys(whose))
        said.append(f"Assumed for {named}: {assumed or 'nothing that its recordings state'}.")
    return said

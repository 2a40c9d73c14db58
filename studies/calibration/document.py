"""The tables of a calibration, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from studies.calibration.analysis import (
    accept,
    by_fitted,
    holds,
    middle,
    output_values,
    parameter_values,
    same_verdicts,
    sensitivities,
    share,
)
from studies.calibration.draws import Draw, Procedure, Result, unit_of
from tactbench.core.tables.markup import markdown
from tactbench.core.tables.text import TextTable, text_table


def tables(result: Result) -> str:
    """Return every table as Markdown, under the calibration's title and who made the draws."""
    makers = ", ".join(f"{name} {value}" for name, value in result.made_by.items())
    made = [
        _published(result.procedure, result.draws),
        _nuisances(result.procedure, result.draws),
        _findings(result.procedure, result.draws),
        _sensitivity(result),
        _agreement(result.procedure, result.draws),
        *(_variation(result, one) for one in result.procedure["variations"]),
    ]
    return (
        f"# {result.procedure['title']}\n\n"
        f"SIM. {len(result.draws)} draws with seed {result.seed}; {result.cpu_s / 60:.0f} minutes of processor time; "
        f"{makers}.\n\n{markdown(made)}"
    )


def _titles(procedure: Procedure) -> dict[str, str]:
    return {one["name"]: one["title"] for one in procedure["outputs"]}


def _acceptance(procedure: Procedure, draws: Sequence[Draw]) -> str:
    kept, tolerance, published = by_fitted(procedure, draws), procedure["tolerance"], procedure["published"]
    chosen = "they are accepted" if len(kept.draws) == kept.near else f"the {len(kept.draws)} nearest are accepted"
    return (
        f"{kept.near} of {len(draws)} draws lie within {tolerance:g} scales of every fitted number; {chosen} and reach "
        f"{kept.reach:.1f} scales. Within {tolerance:g} scales of all {len(published)} published numbers at once: "
        f"{accept(procedure, draws, published).near}."
    )


def _published(procedure: Procedure, draws: Sequence[Draw]) -> TextTable:
    kept, titles = by_fitted(procedure, draws).draws, _titles(procedure)
    units = {one["name"]: one.get("unit", "1") for one in procedure["outputs"]}
    lines = []
    for one in procedure["published"]:
        name, value = one["output"], one["value"]
        others = accept(procedure, draws, [other for other in procedure["published"] if other is not one])
        before, after, by_others = (output_values(some, name) for some in (draws, kept, others.draws))
        lines.append((
            titles[name], one["use"], f"{value:g}" + (f" {units[name]}" if units[name] != "1" else ""),
            _range(before), _range(after), _inside(value, after), _range(by_others), _inside(value, by_others),
            f"{others.reach:.1f}",
        ))  # fmt: skip
    return text_table(
        f"Published numbers: {len(draws)} draws from the prior, {len(kept)} accepted",
        ("number", "use", "published", "prior", "accepted", "inside", "by all others", "inside those", "their reach"),
        lines,
        notes=(_acceptance(procedure, draws),),
    )


def _nuisances(procedure: Procedure, draws: Sequence[Draw]) -> TextTable:
    kept = by_fitted(procedure, draws).draws
    lines = []
    for one in procedure["nuisances"]:
        ranges = (_range(parameter_values(some, one["name"])) for some in (draws, kept))
        lines.append((one["name"], one.get("sets") or one["name"], unit_of(one), *ranges))
    return text_table(
        "Nuisances: median and middle 80 %", ("nuisance", "sets", "unit", "prior", "accepted"), lines
    )  # fmt: skip


def _findings(procedure: Procedure, draws: Sequence[Draw]) -> TextTable:
    return text_table(
        "Findings: share of the draws in which they come out, with Wilson's 95 %",
        ("finding", "prior", "accepted"),
        [(one["statement"], *_shares(procedure, draws, one)) for one in procedure["findings"]],
    )


def _shares(procedure: Procedure, draws: Sequence[Draw], finding: Any) -> tuple[str, str]:
    """Return in which share of all draws, and of the accepted ones, a finding is true."""
    before, after = (
        [holds(finding, draw.outputs) for draw in some] for some in (draws, by_fitted(procedure, draws).draws)
    )
    return _share(before), _share(after)


def _sensitivity(result: Result) -> TextTable:
    titles, names = _titles(result.procedure), [one["name"] for one in result.procedure["nuisances"]]
    found = sensitivities(result.procedure, result.draws, result.seed)
    return text_table(
        "Partial rank correlations; *: the 95 % interval leaves out 0",
        ("number", *names),
        [
            (titles[one["output"]], *(f"{value:+.2f}{'*' if apart else ''}" for value, apart in found[one["output"]]))
            for one in result.procedure["published"] if found
        ],
        numeric=names,
    )  # fmt: skip


def _agreement(procedure: Procedure, draws: Sequence[Draw]) -> TextTable:
    titles, lines = _titles(procedure), []
    for one in procedure["outputs"]:
        if not one.get("stands_for"):
            continue
        some = [draw for draw in draws if one["name"] in draw.outputs]
        cheap, dear = output_values(some, one["stands_for"]), output_values(some, one["name"])
        numbers = (float(spearmanr(cheap, dear).statistic), np.mean(cheap - dear), np.max(np.abs(cheap - dear)))
        lines.append(
            (titles[one["stands_for"]], one["title"], str(len(some)), *(f"{number:.3f}" for number in numbers))
        )
    verdicts = ((one["statement"], same_verdicts(procedure, draws, one)) for one in procedure["findings"])
    return text_table(
        "Cheap answers beside the dear ones they stand for",
        ("cheap", "dear", "draws", "rank correlation", "mean difference", "largest"),
        lines,
        numeric=("draws", "rank correlation", "mean difference", "largest"),
        notes=[f"Cheap and dear answer alike in {_share(own)}: {statement}." for statement, own in verdicts if own],
    )


def _variation(result: Result, variation: Any) -> TextTable:
    titles, lines = _titles(result.procedure), []
    for place, setting in enumerate(variation["settings"], start=1):
        draws = result.variations[variation["name"], place]
        columns = (output_values(draws, name) for name in variation["outputs"])
        spreads = (f"{np.median(one):.3g} ({one.min():.3g} … {one.max():.3g})" for one in columns)
        lines.append((setting["label"], str(len(draws)), *spreads))
    return text_table(
        f"{variation['title']}: median (least … largest) over seeds",
        ("setting", "seeds", *(titles[name] for name in variation["outputs"])),
        lines,
        numeric=("seeds",),
        notes=(f"{variation['reason']} Nothing is drawn from a prior here; the seeds are the same in every setting.",),
    )


def _range(values: Any) -> str:
    found = middle(values)
    return "too few" if found is None else "{:.3g} ({:.3g} … {:.3g})".format(*found)


def _inside(value: float, values: Any) -> str:
    found = middle(values)
    return "–" if found is None else "yes" if found[1] <= value <= found[2] else "no"


def _share(verdicts: Sequence[bool]) -> str:
    return "{:.0%} ({:.0%} … {:.0%})".format(*share(verdicts)) + f" of {len(verdicts)}"

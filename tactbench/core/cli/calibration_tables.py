"""How ``tactbench calibrate`` prints what a calibration says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.calibration.result import CalibrationResult
    from tactbench.core.calibration.summary import Summary
    from tactbench.core.spec.calibration import CalibrationSpec


def print_calibration(result: CalibrationResult, told: Summary, shape: str) -> None:
    """Print what a calibration says in one of `GRID_FORMATS`."""
    from tactbench.core.calibration.summary import acceptance, records
    from tactbench.core.cli.grid import print_grid, print_records
    from tactbench.core.cli.screen import remark

    tables = records(told)
    if shape != "table":
        print_records(_long(tables), shape)
        return
    spec = result.spec
    print_grid(
        f"{spec.title} (SIM): published numbers, {len(told.draws)} draws from the prior, {told.n_accepted} accepted",
        ("number", "use", "published", "prior", "accepted", "inside", "by all others", "inside those", "their reach"),
        [
            {
                "number": line["title"], "use": line["use"], "published": f"{line['published']:g} {_unit(line)}",
                "prior": _range(line, "prior"), "accepted": _range(line, "accepted"),
                "inside": _yes(line["inside"]), "by all others": _range(line, "by_all_others"),
                "inside those": _yes(line["inside_by_all_others"]),
                "their reach": f"{line['by_all_others_reach']:.1f}",
            }
            for line in tables["published"]
        ],
    )  # fmt: skip
    print_grid(
        "Nuisances, median and middle 80 %", ("nuisance", "where", "unit", "prior", "accepted"),
        [
            {"nuisance": line["name"], "where": line["path"], "unit": line["unit"],
             "prior": _range(line, "prior"), "accepted": _range(line, "accepted")}
            for line in tables["parameters"]
        ],
    )  # fmt: skip
    print_grid(
        "Findings: share of the draws in which they come out, 95 %", ("finding", "prior", "accepted"),
        [
            {"finding": line["statement"], "prior": _share(line, "prior"), "accepted": _share(line, "accepted")}
            for line in tables["findings"]
        ],
    )  # fmt: skip
    _print_agreement(tables)
    _print_sensitivity(tables["sensitivity"], spec)
    click.echo(acceptance(spec, told))
    if told.failed:
        reasons = sorted({draw.reason for draw in result.draws if draw.status == "failed"})
        remark(f"{told.failed} draws failed: {reasons[0]}" + (" …" if len(reasons) > 1 else ""))


def _print_agreement(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    from tactbench.core.cli.grid import print_grid

    if not tables["agreement"]:
        return
    print_grid(
        "Cheap answers beside the dear ones they stand for",
        ("cheap", "dear", "draws", "rank correlation", "mean difference", "largest"),
        [
            {"cheap": line["output"], "dear": line["dear"], "draws": str(line["n"]),
             "rank correlation": _number(line["rank_correlation"]),
             "mean difference": _number(line["mean_difference"]), "largest": _number(line["largest_difference"])}
            for line in tables["agreement"]
        ],
        numeric=("draws", "rank correlation", "mean difference", "largest"),
    )  # fmt: skip
    for line in tables["same_verdict"]:
        click.echo(f"Cheap and dear answer {line['finding']!r} alike in {_share(line, 'alike')} of the draws.")


def _print_sensitivity(found: Sequence[Mapping[str, Any]], spec: CalibrationSpec) -> None:
    from tactbench.core.cli.grid import print_grid

    published = [one.output for one in spec.published]
    names = list(dict.fromkeys(line["parameter"] for line in found))
    cells = {
        (line["output"], line["parameter"]): f"{line['correlation']:+.2f}"
        + ("*" if line["low"] > 0 or line["high"] < 0 else "")
        for line in found
    }
    if names:
        print_grid(
            "Partial rank correlations; *: the 95 % interval leaves out 0", ("number", *names),
            [{"number": spec.output(name).title, **{one: cells.get((name, one), "") for one in names}}
             for name in published],
            numeric=names,
        )  # fmt: skip


def _long(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Return all tables as records of one shape, each with the name of its table."""
    keys = list(dict.fromkeys(key for lines in tables.values() for line in lines for key in line))
    return [
        {"table": table, **{key: line.get(key) for key in keys}} for table, lines in tables.items() for line in lines
    ]


def _range(line: Mapping[str, Any], name: str) -> str:
    if line[f"{name}_median"] is None:
        return "too few"
    return f"{line[f'{name}_median']:.3g} ({line[f'{name}_low']:.3g} … {line[f'{name}_high']:.3g})"


def _share(line: Mapping[str, Any], name: str) -> str:
    if line[f"{name}_share"] is None:
        return "no draw"
    low, high = line[f"{name}_low"], line[f"{name}_high"]
    return f"{line[f'{name}_share']:.0%} ({low:.0%} … {high:.0%}) of {line[f'{name}_n']}"


def _unit(line: Mapping[str, Any]) -> str:
    return "" if line["unit"] == "1" else str(line["unit"])


def _yes(value: bool | None) -> str:
    return "–" if value is None else "yes" if value else "no"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"

"""What a calibration says as tables of text, for a terminal, a document or a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tactbench.core.calibration.draw import finished
from tactbench.core.calibration.ranges import median_and_ends
from tactbench.core.calibration.result import CalibrationResult
from tactbench.core.calibration.summary import Summary, acceptance, records, summary
from tactbench.core.spec.calibration import CalibrationSpec, Fixed, Prior, Variation
from tactbench.core.tables.markdown import markdown as tables_as_markdown
from tactbench.core.tables.text_table import TextTable, text_table

Line = Mapping[str, Any]


def text_tables(result: CalibrationResult, stats: Summary) -> list[TextTable]:
    """Return every table that has a row."""
    lines = records(stats)
    tables = (
        _published(result.spec, stats, lines["published"]),
        _nuisances(lines["parameters"]),
        _findings(lines["findings"]),
        _sensitivity(result.spec, lines["sensitivity"]),
        _agreement(result.spec, lines["agreement"], lines["same_verdict"]),
        *(_variation(result, one) for one in result.spec.variations),
        *(() if result.earlier is None else (_beside(result, lines, result.earlier),)),
    )
    return [table for table in tables if table.lines]


def markdown(result: CalibrationResult, stats: Summary) -> str:
    """Return the tables as Markdown, headings and who made the draws included."""
    makers = ", ".join(f"{name} {value}" for name, value in result.made_by.items())
    failed = f", {stats.failed} of them failed" if stats.failed else ""
    out = [
        f"## {result.spec.title}",
        f"SIM. {len(result.draws)} draws with seed {result.seed}{failed}; {result.cpu_s / 60:.0f} minutes of processor "
        f"time; {makers}.",
    ]
    return "\n\n".join([*out, tables_as_markdown(text_tables(result, stats))])


def _table(
    title: str, columns: Sequence[str], rows: Iterable[Mapping[str, str]], *, numeric: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> TextTable:  # fmt: skip
    lines = [[row.get(column, "") for column in columns] for row in rows]
    return text_table(title, columns, lines, numeric=numeric, notes=notes)


def _published(spec: CalibrationSpec, stats: Summary, lines: Sequence[Line]) -> TextTable:
    return _table(
        f"Published numbers: {len(stats.draws)} draws from the prior, {stats.n_accepted} accepted",
        ("number", "use", "published", "prior", "accepted", "inside", "by all others", "inside those", "their reach"),
        tuple(
            {
                "number": line["title"], "use": line["use"], "published": f"{line['published']:g}{_unit(line)}",
                "prior": _range(line, "prior"), "accepted": _range(line, "accepted"), "inside": _yes(line["inside"]),
                "by all others": _range(line, "by_all_others"), "inside those": _yes(line["inside_by_all_others"]),
                "their reach": f"{line['by_all_others_reach']:.1f}",
            }
            for line in lines
        ),
        notes=(acceptance(spec, stats),),
    )  # fmt: skip


def _nuisances(lines: Sequence[Line]) -> TextTable:
    return _table(
        "Nuisances: median and middle 80 %",
        ("nuisance", "sets", "unit", "prior", "accepted"),
        tuple(
            {"nuisance": line["name"], "sets": line["sets"], "unit": line["unit"], "prior": _range(line, "prior"),
             "accepted": _range(line, "accepted")}
            for line in lines
        ),
    )  # fmt: skip


def _findings(lines: Sequence[Line]) -> TextTable:
    return _table(
        "Findings: share of the draws in which they come out, with Wilson's 95 %",
        ("finding", "prior", "accepted"),
        tuple(
            {"finding": line["statement"], "prior": _share(line, "prior"), "accepted": _share(line, "accepted")}
            for line in lines
        ),
    )


def _sensitivity(spec: CalibrationSpec, lines: Sequence[Line]) -> TextTable:
    names = tuple(dict.fromkeys(line["parameter"] for line in lines))
    cells = {
        (line["output"], line["parameter"]): f"{line['correlation']:+.2f}"
        + ("*" if line["low"] > 0 or line["high"] < 0 else "")
        for line in lines
    }
    return _table(
        "Partial rank correlations; *: the 95 % interval leaves out 0",
        ("number", *names),
        tuple(
            {"number": spec.output(one.output).title, **{name: cells.get((one.output, name), "") for name in names}}
            for one in spec.published
            if names
        ),
        numeric=names,
    )


def _agreement(spec: CalibrationSpec, lines: Sequence[Line], verdicts: Sequence[Line]) -> TextTable:
    statements = {finding.name: finding.statement for finding in spec.findings}
    return _table(
        "Cheap answers beside the dear ones they stand for",
        ("cheap", "dear", "draws", "rank correlation", "mean difference", "largest"),
        tuple(
            {"cheap": spec.output(line["output"]).title, "dear": spec.output(line["dear"]).title,
             "draws": str(line["n"]), "rank correlation": _number(line["rank_correlation"]),
             "mean difference": _number(line["mean_difference"]), "largest": _number(line["largest_difference"])}
            for line in lines
        ),
        numeric=("draws", "rank correlation", "mean difference", "largest"),
        notes=tuple(
            f"Cheap and dear answer alike in {_share(line, 'alike')}: {statements[line['finding']]}."
            for line in verdicts
        ),
    )  # fmt: skip


def _variation(result: CalibrationResult, variation: Variation) -> TextTable:
    """Return a table of one variation; no row where nothing was carried out."""
    settings = result.varied.get(variation.name, ())
    titles = {name: result.spec.output(name).title for name in variation.outputs}
    rows = []
    for setting, draws in zip(variation.settings, settings, strict=False):
        found = {name: median_and_ends(draws, name) for name in variation.outputs}
        cells = {titles[name]: _spread(one) for name, one in found.items()}
        rows.append({"setting": setting.label, "seeds": str(len(finished(draws))), **cells})
    return _table(
        f"{variation.title}: median (least … largest) over seeds",
        ("setting", "seeds", *titles.values()),
        tuple(rows),
        numeric=("seeds",),
        notes=(f"{variation.reason} Nothing is drawn from a prior here; the seeds are the same in every setting.",),
    )


def _spread(one: tuple[float, float, float] | None) -> str:
    return "none" if one is None else f"{one[0]:.3g} ({one[1]:.3g} … {one[2]:.3g})"


def _beside(result: CalibrationResult, lines: Mapping[str, Sequence[Line]], earlier: CalibrationResult) -> TextTable:
    """Return published numbers and findings beside those of an earlier calibration that had them too."""
    stats = summary(earlier, sensitivity=False)
    before = records(stats)
    rows = [
        {"number or finding": line[title], "earlier prior": show(old, "prior"), "prior": show(line, "prior"),
         "earlier accepted": show(old, "accepted"), "accepted": show(line, "accepted")}
        for table, key, title, show in (
            ("published", "output", "title", _range), ("findings", "name", "statement", _share),
        )
        for line in lines[table]
        for old in before[table]
        if old[key] == line[key]
    ]  # fmt: skip
    then = {one.name: one.prior for one in earlier.spec.nuisances}
    now = {one.name: one.prior for one in result.spec.nuisances}
    other = [
        f"{name} {_bounds(then.get(name))} then, {_bounds(now.get(name))} now"
        for name in dict.fromkeys((*then, *now))
        if then.get(name) != now.get(name)
    ]
    return _table(
        f"Beside the earlier {len(stats.draws)} draws",
        ("number or finding", "earlier prior", "prior", "earlier accepted", "accepted"),
        tuple(rows),
        notes=(f"Priors that differ: {'; '.join(other) or 'none'}. Earlier: {acceptance(earlier.spec, stats)}",),
    )


def _bounds(prior: Prior | None) -> str:
    if prior is None:
        return "not drawn"
    return f"{prior.value:g}" if isinstance(prior, Fixed) else f"{prior.low:g} to {prior.high:g}"


def _range(line: Line, name: str) -> str:
    if line[f"{name}_median"] is None:
        return "too few"
    return f"{line[f'{name}_median']:.3g} ({line[f'{name}_low']:.3g} … {line[f'{name}_high']:.3g})"


def _share(line: Line, name: str) -> str:
    if line[f"{name}_share"] is None:
        return "no draw"
    low, high = line[f"{name}_low"], line[f"{name}_high"]
    return f"{line[f'{name}_share']:.0%} ({low:.0%} … {high:.0%}) of {line[f'{name}_n']}"


def _unit(line: Line) -> str:
    return "" if line["unit"] == "1" else f" {line['unit']}"


def _yes(value: bool | None) -> str:
    return "–" if value is None else "yes" if value else "no"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"

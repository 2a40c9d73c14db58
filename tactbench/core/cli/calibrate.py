"""``tactbench calibrate``: what the simulated rig cannot know, drawn and held against published numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.grid import GRID_FORMATS
from tactbench.core.cli.threads import keep_threads

if TYPE_CHECKING:
    from tactbench.core.calibration.result import CalibrationResult
    from tactbench.core.calibration.summary import Summary
    from tactbench.core.spec.calibration import CalibrationSpec

_FORMATS = (*GRID_FORMATS, "md")


@click.command(name="calibrate")
@click.option("--draws", type=click.IntRange(min=1), metavar="N", help="How many draws; default: the file's.")
@click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Seed of all draws; default: the file's.")
@click.option("--jobs", type=click.IntRange(min=1), default=1, show_default=True, metavar="N", help="Processes.")
@click.option("--config", type=click.Path(path_type=Path), metavar="FILE", help="A procedure like calibration.yaml.")
@click.option("--show", is_flag=True, help="Draw nothing: show the calibration in DIR, else the one that came along.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("tactbench-results"), show_default=True,
              metavar="DIR", help="Where DIR/calibration lies; draws that are there already are kept.")  # fmt: skip
@click.option("--format", "shape", type=click.Choice(_FORMATS), default="table", show_default=True)
def command(
    draws: int | None, seed: int | None, jobs: int, config: Path | None, show: bool, out: Path, shape: str
) -> None:
    """Draw what no source states, simulate, and keep the draws that come near published numbers.

    Prints which ranges those leave, what they predict for numbers that were held out, and how often each finding of
    the publication comes out. Interrupted, the same command goes on from there.
    """
    keep_threads()
    from tactbench.core.calibration.result import load_result
    from tactbench.core.calibration.summary import summary
    from tactbench.core.cli.screen import remark
    from tactbench.core.errors import UsageError

    if show:
        if draws is not None or seed is not None or config is not None:
            raise UsageError(
                "--show draws nothing.", hint="Leave out --draws, --seed and --config, or leave out --show."
            )
        found = load_result(out)
        if found is None:
            raise UsageError(f"There is no calibration in {out}, and none came along.", hint="Leave out --show.")
        remark(f"Shown: {found.shown}.")
        _print(found, summary(found), shape)
        return
    result = _drawn(_procedure(config), draws, seed, jobs, out)
    stats = summary(result)
    _print(result, stats, shape)
    _write(result, stats, out / "calibration")


def _procedure(config: Path | None) -> CalibrationSpec:
    from tactbench.core.cli.config import default_calibration
    from tactbench.core.spec.calibration import CalibrationSpec
    from tactbench.core.spec.yaml_file import load_yaml

    return load_yaml(config, CalibrationSpec) if config else default_calibration()


def _drawn(spec: CalibrationSpec, draws: int | None, seed: int | None, jobs: int, out: Path) -> CalibrationResult:
    from tactbench.core.calibration.journal import Journal
    from tactbench.core.calibration.result import CalibrationResult
    from tactbench.core.calibration.run import carry_out_missing, carry_out_variations, made_by
    from tactbench.core.calibration.trial import checked
    from tactbench.core.cli.progress import progress
    from tactbench.core.cli.screen import remark
    from tactbench.core.errors import UnwritableError

    checked(spec)
    n_draws, chosen = draws or spec.draws, spec.seed if seed is None else seed
    makers = made_by()
    journal = Journal(out / "calibration" / "draws.jsonl", spec, chosen, makers)
    if journal.remark:
        remark(journal.remark)
    if journal.draws:
        remark(f"{sum(number < n_draws for number in journal.draws)} of {n_draws} draws were found finished.")
    try:
        with progress() as reporter:
            done = carry_out_missing(spec, chosen, n_draws, journal, jobs=jobs, progress=reporter)
            beside = out / "calibration" / "variations"
            varied = carry_out_variations(spec, chosen, beside, makers, jobs=jobs, progress=reporter)
    except OSError as error:
        raise UnwritableError(f"{journal.path} cannot be written: {error}.", hint="Give another --out.") from error
    return CalibrationResult(spec, chosen, tuple(done), journal.made_by, journal.seconds, varied=varied)


def _write(result: CalibrationResult, stats: Summary, folder: Path) -> None:
    import json

    from tactbench.core.calibration.figure import draws_figure, save, sensitivity_figure
    from tactbench.core.calibration.result import write_result
    from tactbench.core.calibration.summary import acceptance, records
    from tactbench.core.cli.screen import remark
    from tactbench.core.errors import UnwritableError
    from tactbench.core.files import replace_file

    tables = records(stats)
    about = {
        "draws": len(stats.draws), "failed": stats.failed, "accepted": stats.n_accepted, "near": stats.n_near,
        "reach": stats.reach, "near_all": stats.n_all, "tolerance": result.spec.tolerance,
        "acceptance": acceptance(result.spec, stats),
    }  # fmt: skip
    texts = {
        "ranges.json": {**about, "parameters": tables["parameters"], "published": tables["published"]},
        "findings.json": {**about, "findings": tables["findings"]},
        "sensitivity.json": {**about, "sensitivity": tables["sensitivity"], "agreement": tables["agreement"],
                             "same_verdict": tables["same_verdict"]},
    }  # fmt: skip
    try:
        write_result(result, folder)
        for name, content in texts.items():
            replace_file(folder / name, (json.dumps(content, indent=1, ensure_ascii=False) + "\n").encode())
        figures = {
            "sensitivity": sensitivity_figure(result.spec, stats.sensitivities),
            "draws": draws_figure(result.spec, stats.draws),
        }
        for name, figure in figures.items():
            save(figure, [folder / f"{name}.png", folder / f"{name}.pdf"])
    except OSError as error:
        raise UnwritableError(f"{folder} cannot be written: {error}.", hint="Give another --out.") from error
    beside = " variations.csv," if result.varied else ""
    remark(f"Files: {folder}/draws.jsonl, draws.csv,{beside} run.json, ranges.json, findings.json, sensitivity.json, "
           "draws.png, .pdf, sensitivity.png, .pdf")  # fmt: skip


def _print(result: CalibrationResult, stats: Summary, shape: str) -> None:
    """Print what a calibration says in one of `_FORMATS`."""
    from tactbench.core.calibration.summary import records
    from tactbench.core.calibration.tables import markdown, text_tables
    from tactbench.core.cli.grid import print_records, print_tables
    from tactbench.core.cli.screen import remark

    if shape == "md":
        click.echo(markdown(result, stats), nl=False)
    elif shape != "table":
        print_records(_records(records(stats)), shape)
    else:
        click.echo(f"{result.spec.title} (SIM)\n")
        print_tables(text_tables(result, stats))
    if stats.failed:
        reasons = sorted({draw.reason for draw in result.draws if draw.status == "failed"})
        remark(f"{stats.failed} draws failed: {reasons[0]}" + (" …" if len(reasons) > 1 else ""))


def _records(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Return all tables as records of one shape, each with the name of its table."""
    keys = list(dict.fromkeys(key for lines in tables.values() for line in lines for key in line))
    return [
        {"table": table, **{key: line.get(key) for key in keys}} for table, lines in tables.items() for line in lines
    ]

"""``tactbench choose``: which sensor meets a wish."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tactbench.core.cli.options import ABOVE_0, DEFAULT_FOLDER, format_option

if TYPE_CHECKING:
    from tactbench.core.choosing.choosing import Choice
    from tactbench.core.spec.task import TaskSpec

Row = dict[str, Any]
_PREFERRED = "deployable"


@click.command(name="choose")
@click.argument("folder", type=click.Path(path_type=Path), required=False)
@click.option("--task", "task_name", required=True, metavar="NAME", help="Task.")
@click.option("--max-delay-ms", type=ABOVE_0, metavar="X", help="Largest delay from touch to answer.")
@click.option("--range-n", type=ABOVE_0, metavar="X", help="Largest normal force to measure.")
@click.option("--rate-hz", type=ABOVE_0, metavar="X", help="Smallest rate of answers.")
@click.option("--score", type=ABOVE_0, metavar="X",
              help="Worst score to accept, in the task's unit; of force as it is ranked.")  # fmt: skip
@click.option("--protocol", metavar="NAME", help="Evaluation protocol. Default: deployable.")
@format_option("table", "json")
def command(
    folder: Path | None, task_name: str, max_delay_ms: float | None, range_n: float | None, rate_hz: float | None,
    score: float | None, protocol: str | None, shape: str,
) -> None:  # fmt: skip
    """Find the sensor that meets given requirements; say which miss them by how much, and what is unknown.

    FOLDER is what `run --out` wrote; default: tactbench-results, and the results that came with tactbench where that
    has none of the task.
    """
    from tactbench.core.choosing.choosing import Wish, choose
    from tactbench.core.plugins.registry import load_registry
    from tactbench.core.tables.text import json_text

    registry = load_registry()
    task = registry.tasks[task_name].spec
    wish = Wish(max_delay_ms, range_n, rate_hz, score)
    rows, origin = _results(folder, task)
    rows, heading = _selected(rows, task, protocol)
    choices = choose(rows, wish, task, {one.name: one.spec for one in registry.sensors})
    if shape == "json":
        content = {"task": task.name, "wish": wish._asdict(), "results": origin, "protocol": rows[0]["protocol"],
                "split": rows[0]["split"], "choices": [choice.record() for choice in choices]}  # fmt: skip
        click.echo(json_text(content, indent=1))
        return
    for choice in choices:
        _print(choice, f"{heading} · {choice.hardware}", origin)


def _results(folder: Path | None, task: TaskSpec) -> tuple[list[Row], str]:
    """Return the rows of a task, and where they are from."""
    from tactbench.core.errors import UsageError
    from tactbench.core.study.results import is_results, opened, shown_rows

    own = folder or DEFAULT_FOLDER
    found: list[Row] = []
    if folder is not None or is_results(own):
        found, origin = [row for row in shown_rows(opened(own)) if row["task"] == task.name], f"the results in {own}"
    if not found and folder is None:
        rows, origin = _shipped()
        found = [row for row in rows if row["task"] == task.name]
    if not found:
        raise UsageError(
            f"There are no results of the task {task.name} in {own}.",
            hint=f"Make some: `tactbench run --task {task.name} --protocol {_PREFERRED}`.",
        )
    return found, origin


def _shipped() -> tuple[list[Row], str]:
    """Return the rows that came with tactbench, and how they were made."""
    from tactbench.core.statistics.replicates import over_replicates
    from tactbench.core.study.shipped import shipped_results

    shipped = json.loads(shipped_results().read_text(encoding="utf-8"))
    origin = (
        f"the results that came with tactbench ({shipped['command']} of version {shipped['version']}, seed "
        f"{shipped['seed']}, {shipped['replicates']}; times of another machine)"
    )
    return over_replicates(shipped["rows"]), origin


def _selected(rows: list[Row], task: TaskSpec, protocol: str | None) -> tuple[list[Row], str]:
    """Return the rows of one protocol and split, and what they are called."""
    from tactbench.core.errors import UnknownNameError

    done = [row for row in rows if row["status"] == "done"] or rows
    protocols = list(dict.fromkeys(row["protocol"] for row in done))
    chosen = protocol or next((name for name in (_PREFERRED, *task.protocols) if name in protocols), protocols[0])
    if chosen not in protocols:
        raise UnknownNameError("protocol with results", chosen, protocols)
    splits = list(dict.fromkeys(str(row["split"]) for row in done if row["protocol"] == chosen))
    kept = next((name for name in task.splits if name in splits), splits[0])
    found = [row for row in rows if row["protocol"] == chosen and str(row["split"]) in (kept, "None")]
    dagger = " † (uses test-set statistics)" if any(row["dagger"] for row in found) else ""
    return found, f"{task.name} · protocol {chosen}{dagger} · split {kept}"


def _print(choice: Choice, heading: str, origin: str) -> None:
    from tactbench.core.cli.grid import print_fields, print_records
    from tactbench.core.tables.numbers import interval, score

    print_fields([("answer", choice.verdict), ("results", f"{heading}, from {origin}")])
    lines = []
    for one in choice.candidates:
        wishes = {each.wish: f"{each.state}: {each.text}" for each in one.criteria}
        wishes["score wished"] = wishes.pop("score", "")
        lines.append({"sensor": one.sensor, "estimator": one.estimator, "score": score(one.score, choice.unit),
                      "interval": interval(one.low, one.high, choice.unit), **wishes})  # fmt: skip
    if lines:
        click.echo()
        print_records(lines, "table", title=f"score: {choice.quantity}", numeric=("score",))
    several = {"interval": choice.intervals, "unknown": choice.unknown, "left out": choice.left_out}
    fields = [(name, text) for name, texts in several.items() for text in texts]
    if fields:
        click.echo()
        print_fields(fields)
    click.echo()

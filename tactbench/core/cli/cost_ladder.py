"""``tactbench cost --sensor S --task T``: score against fit time and answer delay, estimator by estimator."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tactbench.core.tables.text import json_text

if TYPE_CHECKING:
    from tactbench.core.cost.ladder import Ladder
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.matrix import MatrixSpec


def show_ladder(
    sensor: str,
    task: str,
    *,
    rig: str | None,
    recordings: Path | None,
    protocol: str | None,
    split: str | None,
    estimators: tuple[str, ...],
    seed: int,
    repeats: int,
    rounds: int,
    budget: float,
    threads: int,
    out: Path,
    shape: str,
) -> None:
    """Score and time the estimators, print them as `shape`, and write the files of the ladder into `out`."""
    import time

    from tactbench.core.cli.progress import progress
    from tactbench.core.cli.screen import remark
    from tactbench.core.cost.ladder import climb
    from tactbench.core.cost.ladder_file import flat_csv, write_ladder
    from tactbench.core.leaderboard.names import METRIC_NAMES
    from tactbench.core.plugins.declared import declared_in, with_declared
    from tactbench.core.plugins.registry import load_registry

    registry = with_declared(load_registry(), declared_in(recordings))
    rig = rig or ("twin" if recordings is None else "replay")
    matrix = _matrix(registry, sensor, task, rig, protocol, split, estimators or ("all",), seed, repeats)
    store = _store(out, sensor, task)
    with progress() as display:
        ladder = climb(matrix, registry, store, rounds=rounds, budget_s=budget, threads=threads,
                       clock=time.perf_counter, progress=display, recordings=recordings)  # fmt: skip
    if shape == "json":
        click.echo(json_text(ladder.rows, indent=1))
    elif shape == "csv":
        click.echo(flat_csv(ladder), nl=False)
    else:
        _print(ladder)
    paths = write_ladder(ladder, out, METRIC_NAMES.get(ladder.about["metric"], ""))
    remark(f"Files: {', '.join(map(str, paths))}")


def _store(out: Path, sensor: str, task: str) -> Store:
    """Return the folder of the ladder's own cells, `out`/cost, which no leaderboard of `out` shows.

    What a run has finished of the same question, and what it recorded with the sensor, is linked into it and not done
    again; what cannot be linked is.
    """
    from tactbench.core.matrix.store import Store

    store = Store(out / "cost")
    rows = Store(out).rows() if (out / "cells").is_dir() else []
    finished_of = ("done", sensor, task)
    finished = [row for row in rows if (row["status"], row["sensor"], row["task"]) == finished_of]
    cells = [Path("cells", f"{row['key']}.h5") for row in finished]
    recordings = [path.relative_to(out) for path in (out / "recordings" / sensor).glob("*.h5")]
    for path in (*cells, *recordings):
        link = store.folder / path
        with suppress(OSError):
            link.parent.mkdir(parents=True, exist_ok=True)
            link.hardlink_to(out / path)
    return store


def _matrix(
    registry: Registry,
    sensor: str,
    task: str,
    rig: str,
    protocol: str | None,
    split: str | None,
    estimators: tuple[str, ...],
    seed: int,
    repeats: int,
) -> MatrixSpec:
    from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice

    if protocol is None and not registry.rigs[rig].simulated:
        protocol = "deployable"  # as `run` has it: the paper's protocol needs the paper's three roles
    choice = TaskChoice(
        name=task, protocol=protocol, split=split, estimators=tuple(EstimatorChoice(name=name) for name in estimators)
    )
    return MatrixSpec(rig=rig, seed=seed, repeats=repeats, sensors=(sensor,), tasks=(choice,))


def _print(ladder: Ladder) -> None:
    from tactbench.core.cli.grid import print_grid
    from tactbench.core.cli.screen import remark
    from tactbench.core.cost.ladder_file import DEFINITIONS
    from tactbench.core.report.costs import COLUMNS, RIGHT, line, title

    about = ladder.about
    lines = [line(row, about["unit"]) for row in ladder.rows]
    kinds = ["result" if row["front_fit"] or row["front_delay"] else "" for row in ladder.rows]
    print_grid(title(about), COLUMNS, lines, numeric=RIGHT, kinds=kinds)
    if about["load"] is not None and about["load"] > about["cores"]:
        remark(
            f"The machine was busy: {about['load']:.1f} processes wanted its {about['cores']} cores. Others' work is "
            "in these times, most of all in the 95th percentiles; time on an idle machine before you quote them."
        )
    for text in about["remarks"]:
        remark(f"{text[0].upper()}{text[1:]}.")
    for key, text in DEFINITIONS.items():
        remark(f"{key}: {text}.")

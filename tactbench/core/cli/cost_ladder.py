"""``tactbench cost --sensor S --task T``: score against fit time and latency, estimator by estimator."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from tactbench.core.cost.ladder import Ladder
    from tactbench.core.plugins.registry import Registry
    from tactbench.core.spec.matrix import MatrixSpec

_COLUMNS = (
    "estimator", "score", "95 % interval", "fit", "quartiles", "latency p50", "p95", "batch/row", "data", "front",
    "100 Hz loop", "1 kHz loop", "remark",
)  # fmt: skip
_RIGHT = ("score", "fit", "latency p50", "p95", "batch/row", "data")


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
    rounds: int,
    budget: float,
    threads: int,
    out: Path,
    shape: str,
) -> None:
    """Score and time the estimators, print them as `shape`, and write the files of the ladder into `out`."""
    import time

    from tactbench.core.cli.screen import progress, remark
    from tactbench.core.cost.ladder import climb
    from tactbench.core.cost.ladder_file import flat_csv, write_ladder
    from tactbench.core.leaderboard.table import METRIC_NAMES
    from tactbench.core.matrix.store import Store
    from tactbench.core.plugins.registry import load_registry

    registry = load_registry()
    rig = rig or ("twin" if recordings is None else "replay")
    matrix = _matrix(registry, sensor, task, rig, protocol, split, estimators or ("all",), seed)
    store = Store(out)
    with progress() as told:
        ladder = climb(matrix, registry, store, rounds=rounds, budget_s=budget, threads=threads,
                       clock=time.perf_counter, progress=told, recordings=recordings)  # fmt: skip
    if shape == "json":
        click.echo(json.dumps(ladder.rows, indent=1, ensure_ascii=False, allow_nan=False))
    elif shape == "csv":
        click.echo(flat_csv(ladder), nl=False)
    else:
        _print(ladder)
    paths = write_ladder(ladder, store.folder, METRIC_NAMES.get(ladder.about["metric"], ""))
    remark(f"Files: {', '.join(map(str, paths))}")


def _matrix(
    registry: Registry,
    sensor: str,
    task: str,
    rig: str,
    protocol: str | None,
    split: str | None,
    estimators: tuple[str, ...],
    seed: int,
) -> MatrixSpec:
    from tactbench.core.spec.matrix import EstimatorChoice, MatrixSpec, TaskChoice

    if protocol is None and not registry.rigs[rig].simulated:
        protocol = "deployable"  # as `run` has it: the paper's protocol needs the paper's three roles
    choice = TaskChoice(
        name=task, protocol=protocol, split=split, estimators=tuple(EstimatorChoice(name=name) for name in estimators)
    )
    return MatrixSpec(rig=rig, seed=seed, sensors=(sensor,), tasks=(choice,))


def _print(ladder: Ladder) -> None:
    from tactbench.core.cli.grid import print_grid
    from tactbench.core.cli.screen import remark
    from tactbench.core.cost.ladder_file import DEFINITIONS
    from tactbench.core.leaderboard.table import METRIC_NAMES

    about = ladder.about
    better = "higher" if about["higher_is_better"] else "lower"
    simulated = f" · SIM ({about['rig']})" if about["simulated"] else ""
    dagger = " †" if about["dagger"] else ""
    threads = "1 thread" if about["threads"] == 1 else f"{about['threads']} threads"
    metric = METRIC_NAMES.get(about["metric"], about["metric"])
    title = (
        f"{about['sensor']}, {about['task']}: {metric}, {better} is better · "
        f"{about['protocol']}{dagger} · split {about['split']}{simulated} · {about['rounds']} rounds, {threads}"
    )
    lines = [_line(row, about["unit"]) for row in ladder.rows]
    styles = ["bold" if row["front_fit"] or row["front_latency"] else "" for row in ladder.rows]
    print_grid(title, _COLUMNS, lines, numeric=_RIGHT, styles=styles)
    if about["load"] is not None and about["load"] > about["cores"]:
        remark(
            f"The machine was busy: {about['load']:.1f} processes wanted its {about['cores']} cores. Others' work is "
            "in these times, most of all in the 95th percentiles; time on an idle machine before you quote them."
        )
    for key, text in DEFINITIONS.items():
        remark(f"{key}: {text}.")


def _line(row: Mapping[str, Any], unit: str) -> dict[str, str]:
    from tactbench.core.leaderboard.numbers import duration, interval, score

    name = f"{row['estimator']} (trivial)" if row["is_baseline"] else row["estimator"]
    told = "; ".join((*([f"{row['status']}: {row['reason']}"] if row["status"] != "done" else []), *row["notes"]))
    line = {"estimator": name, "remark": told}
    if row["score"] is not None:
        line |= {"score": score(row["score"], unit), "95 % interval": interval(row["ci_low"], row["ci_high"], unit)}
    if row["fit_s"] is None:
        return line
    fronts = [what for what, on in (("fit", row["front_fit"]), ("latency", row["front_latency"])) if on]
    return line | {
        "fit": duration(row["fit_s"]),
        "quartiles": f"{duration(row['fit_s_q1'])} … {duration(row['fit_s_q3'])}",
        "latency p50": duration(row["latency_ms_p50"] / 1e3),
        "p95": duration(row["latency_ms_p95"] / 1e3),
        "batch/row": duration(row["batch_s_per_row"]),
        "data": duration(row["data_s"]),
        "front": ", ".join(fronts),
        "100 Hz loop": "yes" if row["loop_100_hz"] else "no",
        "1 kHz loop": "yes" if row["loop_1000_hz"] else "no",
    }

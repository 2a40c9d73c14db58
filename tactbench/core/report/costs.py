"""What accuracy costs in time, as `tactbench cost` has measured it: on the terminal and on the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tactbench.core.leaderboard.names import METRIC_NAMES
from tactbench.core.tables.numbers import delay, duration, interval, score, tail
from tactbench.core.tables.text_table import Entry, TextTable, finite, text_table

_SORTED_BY = {
    "estimator": "", "score": "score", "95 % interval": "ci_low", "fit": "fit_s", "quartiles": "fit_s_q1",
    "delay": "answer_delay_ms", "latency p50": "latency_ms_p50", "p95": "latency_ms_p95",
    "batch/row": "batch_s_per_row", "front": "", "remark": "",
}  # fmt: skip
"""Column -> key of the number behind it."""


def _title(about: Mapping[str, Any]) -> str:
    """Return what holds for all rows: question, metric, protocol, rounds, threads."""
    better = "higher" if about["higher_is_better"] else "lower"
    simulated = f" · SIM ({about['rig']})" if about["simulated"] else ""
    dagger = " †" if about["dagger"] else ""
    metric = METRIC_NAMES.get(about["metric"], about["metric"])
    return (
        f"{about['sensor']}, {about['task']}: {metric}, {better} is better · "
        f"{about['protocol']}{dagger} · split {about['split']}{simulated} · {about['rounds']} rounds, 1 thread"
    )


def _line(row: Mapping[str, Any], unit: str) -> dict[str, str]:
    """Return one estimator's texts by column; what was not measured is left out."""
    what = "oracle" if row.get("looks_at") == "reference" else "trivial"
    name = f"{row['estimator']} ({what})" if row["is_baseline"] else row["estimator"]
    remark = "" if row["status"] == "done" else f"{row['status']}: {row['reason']}"
    texts = {"estimator": name, "remark": remark}
    if row["score"] is not None:
        texts |= {"score": score(row["score"], unit), "95 % interval": interval(row["ci_low"], row["ci_high"], unit)}
    if row["fit_s"] is None:
        return texts
    fronts = [what for what, on in (("fit", row["front_fit"]), ("delay", row["front_delay"])) if on]
    return texts | {
        "fit": duration(row["fit_s"]),
        "quartiles": f"{duration(row['fit_s_q1'])} … {duration(row['fit_s_q3'])}",
        "delay": delay(row["answer_delay_ms"], row["delay_parts_ms"]),
        "latency p50": duration(row["latency_ms_p50"] / 1e3),
        "p95": tail(row["latency_ms_p95"], row["latency_ms_max"], row["latency_n"]),
        "batch/row": duration(row["batch_s_per_row"]),
        "front": ", ".join(fronts),
    }


def ladder_table(about: Mapping[str, Any]) -> TextTable:
    """Return what a file of `tactbench cost` says, as the terminal shows it; raises KeyError where it is damaged."""
    lines = []
    for row in about["rows"]:
        texts = _line(row, about["unit"])
        lines.append([Entry(texts.get(name, ""), finite(row.get(key))) for name, key in _SORTED_BY.items()])
    kinds = ["baseline" if row["is_baseline"] else "result" if row["status"] == "done" else "failed"
             for row in about["rows"]]  # fmt: skip
    words = [*(f"{text}." for text in about["remarks"]), "docs/glossary.md says what each column is."]
    numeric = [name for name, key in _SORTED_BY.items() if key]
    return text_table(_title(about), tuple(_SORTED_BY), lines, numeric=numeric, notes=words, kinds=kinds)

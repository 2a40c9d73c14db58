"""What a row's keys are about: in which order, and under which titles, a page tells them."""

from __future__ import annotations

GROUPS: dict[str, tuple[str, ...]] = {
    "Configuration": (
        "cell", "key", "sensor", "task", "rig", "simulated", "emulated", "protocol", "dagger", "split", "estimator",
        "is_baseline", "looks_at", "answer_per", "answer_from", "declared_task", "repeat", "repeats", "seed",
        "threads",
    ),
    "Answer": (
        "status", "reason", "signal", "metric", "unit", "score", "ci_low", "ci_high", "ci_method",
        "reference_floor", "score_beyond_floor", "beyond_floor_ci_low", "beyond_floor_ci_high", "true_score",
        "true_ci_low", "true_ci_high", "tare_s", "baseline",
        "published", "published_reference", "published_remark", "equivalence", "reference_score", "n_recordings",
        "n_sessions", "n_train", "n_test",
    ),
    "Times and memory": (
        "sim_s", "search_s", "fit_s", "predict_s", "batch_rows", "latency_ms_p50", "latency_ms_p95",
        "latency_ms_max", "latency_n", "answer_delay_ms",
        "wall_s", "peak_rss_mb", "host", "concurrency", "made_by",
    ),
}  # fmt: skip
"""Single values; a key that is in no group comes last, so that none is ever left out."""

TITLES = {
    "params": "Parameters other than the defaults",
    "chosen": "Chosen on validation data",
    "search": "Every candidate that was compared",
    "scores": "Other scores: by class, by fold, by other metrics",
    "events": "Events: at the threshold that validation recordings chose",
    "operating_points": "Events at thresholds for other bounds of false alarms",
    "delay_parts_ms": "Parts of the answer delay [ms]",
    "counts": "What was counted",
    "assumptions": "Assumed by the simulation",
    "plan": "Effects of the first recording: included and left out, with reasons",
    "confusion": "Confusion: true class down, answer across [rows]",
    "recordings": "Recordings",
    "remarks": "Remarks of the recordings",
    "stamps": "Stamps",
    "replicates": "What the interval is over",
}
"""Lists and tables."""

APART = ("traceback", "classes")
"""Shown in places of their own."""

"""The format of a row: what may stand under each of its keys, for whoever writes, reads or shows rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

_NOTHING = type(None)
_WORDS = {
    str: "text", float: "a number", int: "a whole number", bool: "yes or no", list: "a list", dict: "a mapping",
    _NOTHING: "nothing",
}  # fmt: skip


@dataclass(frozen=True)
class Held:
    """What may stand under a key."""

    types: frozenset[type]
    inside: frozenset[type] = frozenset()
    """Types of what a list, or the values of a mapping, may hold; empty: any."""


def in_words(types: Iterable[type]) -> str:
    """Return types in words: ``a number or nothing``."""
    given = set(types)
    if float in given:  # any whole number is a number
        given.discard(int)
    return " or ".join([word for one, word in _WORDS.items() if one in given])


def _each(names: str, types: Iterable[type], inside: Iterable[type] = ()) -> dict[str, Held]:
    return dict.fromkeys(names.split(), Held(frozenset(types), frozenset(inside)))


_NUMBERS = (int, float)

LOWER_IS_BETTER = frozenset({"rmse", "mae"})
"""Metrics of a row's score that are errors."""

FORMAT: Mapping[str, Held] = {
    **_each("key cell sensor task rig protocol estimator status reason traceback log metric unit ci_method", [str]),
    **_each("published_reference published_remark host made_by looks_at", [str]),
    **_each("split", [str, _NOTHING]),
    **_each("repeat repeats seed", [int]),
    **_each("signal n_recordings n_sessions n_train n_test batch_rows latency_n threads concurrency", [int, _NOTHING]),
    **_each("score ci_low ci_high baseline published equivalence reference_score", [*_NUMBERS, _NOTHING]),
    **_each("reference_floor score_beyond_floor beyond_floor_ci_low beyond_floor_ci_high", [*_NUMBERS, _NOTHING]),
    **_each("true_score true_ci_low true_ci_high tare_s", [*_NUMBERS, _NOTHING]),
    **_each("sim_s search_s fit_s predict_s latency_ms_p50 latency_ms_p95 peak_rss_mb wall_s", [*_NUMBERS, _NOTHING]),
    **_each("latency_ms_max answer_delay_ms", [*_NUMBERS, _NOTHING]),
    **_each("is_baseline simulated emulated dagger", [bool]),
    **_each("stamps remarks recordings digests", [list], [str]),
    **_each("n_replicates", [int, _NOTHING]),
    **_each("replicate_unit", [str, _NOTHING]),
    **_each("score_min score_max recordings_right recordings_asked", [*_NUMBERS, _NOTHING]),
    **_each("replicate_scores seeds", [list, _NOTHING], _NUMBERS),
    **_each("plan search", [list], [dict]),
    **_each("classes", [list], [str, bool, *_NUMBERS]),
    **_each("confusion", [list, _NOTHING], [list]),
    **_each("counts chosen scores delay_parts_ms", [dict], _NUMBERS),
    **_each("params simulation assumptions replicates fold_sizes", [dict]),
}
"""By key. A row may have other keys, of which nothing is asked."""

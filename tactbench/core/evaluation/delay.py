"""How late an answer is: from a change at the skin to the answer that knows of it, part by part."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tactbench.core.evaluation.protocols import ProtocolSpec
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import StreamSpec

if TYPE_CHECKING:
    from tactbench.core.evaluation.dataset import Dataset, Table

RATE_TOLERANCE = 0.01
"""Relative difference of rates beyond which a remark says so: rates are stated to two or three digits."""

NO_LINK = "link delay unknown: the answer delay is without it"
NO_RATE = "answer delay unknown: the recordings do not tell their sampling rate"
_OF_READINGS = ("sampling", "window", "features")


def reading_delay_ms(data: Dataset, rules: ProtocolSpec, k: int) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the parts of the answer delay that no machine decides, in ms, and remarks on them.

    Parameters
    ----------
    data
        The recordings that were asked, with the features that the answers used.
    k
        Rows that the mean filter looks back.

    Returns
    -------
    dict, tuple
        ``sampling``: one interval of the slowest stream used, at the sensor's own rate: a change just after a sample
        waits that long for the next one. Where the sensor states no rate, the interval of the recordings.
        ``link``: as the sensor's spec states it.
        ``window``: the group delay of the mean filter at the rate of the recordings, `k` / 2 intervals (a mean of n
        samples has linear phase of slope (n - 1) / 2; Oppenheim and Schafer, Discrete-Time Signal Processing, section
        5.7). Samples that a protocol drops are not counted, nor the shorter windows at the start of a recording.
        A part that is not known is absent.
    """
    parts: dict[str, float] = {}
    interval_s = row_interval_s(data)
    remarks: dict[str, None] = {}
    own: list[float | None] = []
    for meta in data.metas:
        for place, stream in enumerate(_used(meta, data)):
            sampled_hz = 1.0 / interval_s if place == 0 and interval_s else stream.rate_hz
            own_hz = meta.own_rates_hz.get(stream.name, stream.rate_hz) or sampled_hz
            own.append(own_hz)
            if own_hz and sampled_hz and abs(sampled_hz - own_hz) > RATE_TOLERANCE * own_hz:
                remarks[f"{stream.name} sampled at {sampled_hz:.4g} Hz; its own rate is {own_hz:.4g} Hz"] = None
    known = [rate for rate in own if rate]
    if known and len(known) == len(own):
        parts["sampling"] = 1e3 / min(known)
    links = [meta.sensor.link_delay for meta in data.metas]
    stated = [link.to("ms") for link in links if link is not None]
    if len(stated) == len(links):
        parts["link"] = max(stated)
    else:
        remarks[NO_LINK] = None
    if k == 0 or rules.first_row_only:
        parts["window"] = 0.0
    elif interval_s:
        parts["window"] = 1e3 * interval_s * k / 2
    if not {"sampling", "window"} <= parts.keys():
        remarks = {NO_RATE: None}
    return parts, tuple(remarks)


def answer_delay_ms(parts_ms: Mapping[str, float], looks_at: str) -> float | None:
    """Return the sum of the parts; None where one that the answer needs is not known.

    An answer that looks at no reading needs ``prediction`` alone. Without ``link`` the sum is a lower bound.
    """
    needed = ("prediction", *(_OF_READINGS if looks_at == "features" else ()))
    return sum(parts_ms.values()) if all(name in parts_ms for name in needed) else None


def _used(meta: RecordingMeta, data: Dataset) -> list[StreamSpec]:
    """Return the streams that carry features, first the one whose clock is that of the rows."""
    used = [one for one in meta.sensor.streams if any(channel.name in data.features for channel in one.channels)]
    return sorted(used, key=lambda one: all(channel.name != data.features[0] for channel in one.channels))


def row_interval_s(data: Dataset) -> float | None:
    """Return the interval between rows, the longest of all recordings: the median of the clock's steps.

    Without a clock, by the rate that the stream states; None where a recording has neither.
    """
    found = [_step_s(table) or _stated_s(_used(table.meta, data)[0]) for table in data.tables]
    known = [interval for interval in found if interval]
    return max(known) if len(known) == len(found) else None


def _step_s(table: Table) -> float | None:
    timed = table.meta.clock != "none" and len(table.time_s) > 1
    return float(np.median(np.diff(table.time_s))) if timed else None


def _stated_s(stream: StreamSpec) -> float | None:
    return 1.0 / stream.rate_hz if stream.rate_hz else None

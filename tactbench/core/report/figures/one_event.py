"""One slip: what the fastest stream read, its spectrogram, the label, and when each detector raised its alarms."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tactbench.core.errors import NotApplicable, TactbenchError
from tactbench.core.evaluation.dataset import Table, load_dataset
from tactbench.core.evaluation.frames import fastest
from tactbench.core.leaderboard.names import answer_name
from tactbench.core.report.figures.group import Group, Panel, Remark
from tactbench.core.report.figures.sketch import Sketch, heading, marks, sensors
from tactbench.core.report.figures.style import BLACK, GREY, PAGE_IN, SKY, VERMILLION, panels
from tactbench.core.samples import Answers, FloatArray, StreamReadings

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE_S, AFTER_S = 0.5, 1.0
"""Of the onset, that are shown."""
SEGMENTS = 60
"""About so many lines of time of the spectrogram, half overlapping."""


class _Shown(NamedTuple):
    panel: Panel
    table: Table
    event_s: tuple[float, float]
    alarms_s: Mapping[str, FloatArray]
    """By detector."""


def draw(group: Group, remark: Remark) -> Sketch:
    """Draw a column a sensor: signal, spectrogram, alarms of all detectors.

    Raises
    ------
    NotApplicable
        If no recording with a slip can be read.
    """
    found: list[_Shown] = []
    for panel in group.panels:
        try:
            found.append(_shown(group, panel))
        except TactbenchError as error:
            remark(f"No slip of {panel.row['cell']} is drawn: {error}")
    if not found:
        raise NotApplicable("no test recording with a slip can be read")
    figure, axes = panels(3, len(found), 1.3, width_in=PAGE_IN, sharex="col")
    for column, one in enumerate(found):
        stream = fastest(one.table.readings)
        _signal(axes[0, column], one, stream)
        _spectrogram(axes[1, column], one, stream)
        _alarms(axes[2, column], one)
        axes[0, column].set_title(f"{one.panel.sensor}, {stream.stream}: {one.table.meta.name}")
    figure.suptitle(heading(group))
    caption = (
        "The first slip of the test set that the detector of the heading found, or else the first of all, one column "
        f"a sensor ({sensors(group)}). Above: the first channel of the fastest stream, as recorded; shaded: labelled "
        "gross slip, by the reference alone. Middle: its spectrogram, power in dB. Below: alarms of every detector, at "
        "the ends of frames, without the time that computing takes. Time counts from the labelled onset."
        f"{marks(group)}"
    )
    return Sketch("one-event", "One slip, and when it was noticed", caption, group, figure)


def _shown(group: Group, panel: Panel) -> _Shown:
    test = panel.answers["test"]
    slips = np.flatnonzero(test.y_true == 1)
    if not slips.size:
        raise NotApplicable("no test recording has a slip")
    hits = slips[test.y_pred[slips] == 1]
    place = int(test.recording[(hits if hits.size else slips)[0]])
    path = group.results.recordings(panel.row)[place]
    table = load_dataset(group.task, [path]).tables[0]
    if table.reference is None or not len(table.reference.labels[1.0].gross_ns):
        raise NotApplicable(f"recording {table.meta.name!r} has no slip")
    onset_ns, end_ns = table.reference.labels[1.0].gross_ns[0]
    alarms = {}
    for row in group.results.rows:
        same = all(row[key] == panel.row[key] for key in ("sensor", "task", "protocol", "split", "rig"))
        if same and row["status"] == "done" and path.name in [name.rpartition("/")[2] for name in row["recordings"]]:
            own = [name.rpartition("/")[2] for name in row["recordings"]].index(path.name)
            answers = group.results.answers(row).get("test")
            if answers is not None:
                alarms[answer_name(row)] = _alarm_times(answers, own)
    return _Shown(panel, table, (onset_ns * 1e-9, end_ns * 1e-9), alarms)


def _alarm_times(answers: Answers, recording: int) -> FloatArray:
    return np.asarray(answers.time_s[(answers.recording == recording) & (answers.y_pred == 1)], dtype=np.float64)


def _signal(here: Axes, one: _Shown, stream: StreamReadings) -> None:
    onset, end = one.event_s
    time_s = np.zeros(0) if stream.time_s is None else stream.time_s - onset
    near = (time_s >= -BEFORE_S) & (time_s <= AFTER_S)
    here.plot(time_s[near], stream.data[near, 0], color=BLACK, linewidth=0.5, rasterized=True)
    here.axvspan(0.0, min(end - onset, AFTER_S), color=SKY, alpha=0.3, linewidth=0)
    here.set_xlim(-BEFORE_S, AFTER_S)
    here.set_ylabel(stream.channels[0])


def _spectrogram(here: Axes, one: _Shown, stream: StreamReadings) -> None:
    onset, rate_hz = one.event_s[0], stream.rate_hz or 1.0
    time_s = np.zeros(0) if stream.time_s is None else stream.time_s - onset
    near = (time_s >= -BEFORE_S) & (time_s <= AFTER_S)
    length = max(8, int(near.sum()) * 2 // SEGMENTS)
    if near.sum() < 2 * length:
        here.set_visible(False)
        return
    signal = importlib.import_module("scipy.signal")
    hertz, at, power = signal.spectrogram(stream.data[near, 0], rate_hz, nperseg=length, noverlap=length // 2)
    floor = max(float(power.max()) * 1e-6, np.finfo(np.float64).tiny)
    here.pcolormesh(at + time_s[near][0], hertz, 10 * np.log10(np.maximum(power, floor)), cmap="viridis",
                    shading="nearest", rasterized=True)  # fmt: skip
    here.axvline(0.0, color=VERMILLION, linewidth=0.6)
    here.set_ylabel("frequency [Hz]")


def _alarms(here: Axes, one: _Shown) -> None:
    names = list(one.alarms_s)
    for place, name in enumerate(names):
        at = one.alarms_s[name] - one.event_s[0]
        at = at[(at >= -BEFORE_S) & (at <= AFTER_S)]
        here.plot(at, np.full(len(at), place), "|", color=BLACK, markersize=5)
    here.axvline(0.0, color=VERMILLION, linewidth=0.6)
    here.axvspan(0.0, min(one.event_s[1] - one.event_s[0], AFTER_S), color=SKY, alpha=0.3, linewidth=0)
    here.set_yticks(range(len(names)), names)
    here.set_ylim(len(names) - 0.5, -0.5)
    here.tick_params(axis="y", length=0, colors=GREY)
    here.set_xlabel("time since the onset [s]")

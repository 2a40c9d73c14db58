"""How well a class is told at low, middle and high force."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import NotApplicable
from tactbench.core.evaluation.metrics import metric_called
from tactbench.core.report.figures.group import Group, Panel, Sketch
from tactbench.core.report.figures.style import MARKERS, cycled, legend, panels
from tactbench.core.samples import Answers, FloatArray
from tactbench.core.tables.numbers import whole

WINDOW_S = 1.0
"""A reading of a reference carries noise as large as a band is wide; the mean of a hundred a tenth of it."""
_CLOCK_S = 1e-9
"""Resolution of the clocks: rounding must not decide whether a row just half a second away is in a mean."""
EDGES_N = (1.5, 3.0)
"""A band is from one edge up to the next; the outer ones are open."""
BANDS = ("below 1.5", "1.5 to 3", "3 and above")


def draw(group: Group) -> Sketch:
    """Draw the score in each band, one line a sensor.

    Raises
    ------
    NotApplicable
        If no sensor's test set has a reference force.
    """
    shown = [panel for panel in group.panels if np.isfinite(panel.answers["test"].force_n).any()]
    if not shown:
        raise NotApplicable("no test row has a reference force")
    figure, ((here,),) = panels(1, 1, 1.9)
    counts = []
    for place, panel in enumerate(shown):
        scores, rows = banded(group, panel)
        here.plot(
            BANDS, scores, color=group.colours[panel.sensor], marker=cycled(MARKERS, place), markersize=4,
            label=panel.sensor,
        )  # fmt: skip
        counts.append(f"{panel.sensor} {', '.join(map(whole, rows))}")
    here.set_xlabel(f"reference force [N], centred mean over {WINDOW_S:g} s")
    here.set_ylabel(group.metric)
    here.set_ylim(bottom=min(0.0, here.get_ylim()[0]))
    legend(figure, [here])
    caption = (
        f"{group.metric} of the test set in three bands of force, by the reference's, smoothed within a recording by a "
        f"centred mean over {WINDOW_S:g} s, since a single reading is noisy; test rows in them: {'; '.join(counts)}. A "
        "class that is missing in a band counts as 0."
    )
    return group.sketch("score-by-force", f"Does more force tell the {group.quantity} better?", caption, figure)


def banded(group: Group, panel: Panel) -> tuple[list[float], list[int]]:
    """Return the score in every band, NaN where it has no rows, and the number of its rows."""
    test, metric, n_classes = panel.answers["test"], metric_called(group.task.metric), len(panel.row["classes"])
    bands = membership(smoothed_force(test))
    scores = [metric.of(test.y_true[own], test.y_pred[own], n_classes) if own.any() else np.nan for own in bands]
    return scores, [int(own.sum()) for own in bands]


def membership(force_n: FloatArray) -> list[npt.NDArray[np.bool_]]:
    """Return a mask for each band; a row without force is in none."""
    edges = (-np.inf, *EDGES_N, np.inf)
    return [(force_n >= low) & (force_n < high) for low, high in itertools.pairwise(edges)]


def smoothed_force(answers: Answers) -> FloatArray:
    """Return (n,) the mean force, N, of the rows of the same recording within half a second to either side.

    Rows without force are left out of the means, and a mean of none is NaN. Near the ends, and where the protocol has
    discarded samples, a mean is over what there is.
    """
    smooth = np.full(len(answers), np.nan)
    half = WINDOW_S / 2 + _CLOCK_S
    for one in np.unique(answers.recording):
        mine = answers.recording == one
        own = np.flatnonzero(mine & np.isfinite(answers.force_n))
        if not len(own):
            continue
        own = own[np.argsort(answers.time_s[own], kind="stable")]
        centre = answers.force_n[own].mean()  # cumulative sums of a large offset would lose digits
        total = np.concatenate([[0.0], np.cumsum(answers.force_n[own] - centre)])
        first, last = (np.searchsorted(answers.time_s[own], answers.time_s[mine] + end) for end in (-half, half))
        with np.errstate(invalid="ignore"):  # no rows: NaN
            smooth[mine] = (total[last] - total[first]) / (last - first) + centre
    return smooth

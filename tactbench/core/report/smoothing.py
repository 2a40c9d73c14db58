"""The reference force without most of its noise."""

from __future__ import annotations

import numpy as np

from tactbench.core.samples import Answers, FloatArray

WINDOW_S = 1.0
"""A reading of a reference carries noise as large as a band is wide; the mean of a hundred a tenth of it."""

_CLOCK_S = 1e-9
"""Resolution of the clocks: rounding must not decide whether a row just half a second away is in a mean."""


def smoothed_force(answers: Answers) -> FloatArray:
    """Return (n,) the mean force, N, of the rows of the same recording within half a second to either side.

    Rows without force are left out of the means, and a mean of none is NaN. Near the ends, and where the protocol has
    discarded samples, a mean is over what there is. A recording without clock counts its rows as seconds, so that
    nothing is smoothed.
    """
    smooth = np.full(len(answers), np.nan)
    for one in np.unique(answers.recording):
        mine = np.flatnonzero(answers.recording == one)
        mine = mine[np.argsort(answers.time_s[mine], kind="stable")]
        time, force = answers.time_s[mine], answers.force_n[mine]
        there = np.isfinite(force)
        if not there.any():
            continue
        centre = force[there].mean()  # cumulative sums of a large offset would lose digits
        total = np.concatenate([[0.0], np.cumsum(np.where(there, force - centre, 0.0))])
        count = np.concatenate([[0], np.cumsum(there)])
        half = WINDOW_S / 2 + _CLOCK_S
        first = np.searchsorted(time, time - half, side="left")
        last = np.searchsorted(time, time + half, side="right")
        rows = count[last] - count[first]
        smooth[mine] = np.divide(total[last] - total[first], rows, out=np.full(len(mine), np.nan), where=rows > 0)
        smooth[mine] += centre
    return smooth

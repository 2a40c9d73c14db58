"""Where the indenter touches the skin, as a reference stream of the recordings that ask for it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from tactbench.plugin import ChannelSpec, FloatArray, NotApplicable, Quality, Source, StreamSpec
from tactbench.rigs.twin.synthesis import Synthesis

STREAM = "contact_point"
CHANNELS = tuple(ChannelSpec(name=name, kind="position", unit="m") for name in ("x", "y"))
"""On the unrolled skin: ``x`` along the finger towards the tip, ``y`` along the arc of its outer surface."""


def contact_point(
    run: Synthesis, rate_hz: float, rate_source: Source
) -> tuple[StreamSpec, FloatArray, npt.NDArray[np.uint8]]:
    """Return the stream of the apex of the indenter on the skin, its (n, 2) samples [m] and their quality.

    While nothing presses there is no sample.

    Raises
    ------
    NotApplicable
        If the indenter slides: the twin computes its pressure where it was pressed on, and nowhere else.
    """
    if run.scene.slide is not None:
        raise NotApplicable(
            "The twin does not move the contact over the skin: no place can be recorded of an indenter that slides.",
            hint="Leave `slide` out, or `position` out of what is observed.",
        )
    place_m = 1e-3 * np.array([run.contact.x_mm, run.contact.s_mm])
    quality = np.where(run.load.at(run.t_s) > 0, Quality.GOOD, Quality.MISSING).astype(np.uint8)
    stream = StreamSpec(name=STREAM, rate_hz=rate_hz, rate_source=rate_source, channels=CHANNELS)
    return stream, np.tile(place_m, (run.t_s.size, 1)), np.column_stack([quality, quality])

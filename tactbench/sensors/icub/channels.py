"""The 12 taxels of the classic iCub fingertip."""

from __future__ import annotations

import math

from tactbench.plugin import ChannelSpec, Source, StreamSpec, measured

OUTER_RADIUS_MM = 6.5
"""Radius of the fingertip's outer surface: half of the width of 13 mm that Schmitz et al. 2010 state."""

PLACES_MM: tuple[tuple[float, float], ...] = (
    (6.0, 0.0), (4.0, -2.4), (4.0, 2.4), (1.5, 0.0), (1.0, -4.2), (1.0, 4.2),
    (-1.6, -1.9), (-1.6, 1.9), (-2.6, -5.2), (-2.6, 5.2), (-5.0, -2.2), (-5.0, 2.2),
)  # fmt: skip
"""Places (axial towards the tip, along the arc) of the taxels T1 to T12 on the outer surface; assumed."""

_PLACE_SOURCE = Source(
    tag="assumed",
    reference="laid out to cover the pad; robotology/icub-main's left_hand_V2_1.txt has zeros for the fingertips, "
    "and the published table of the newer fingertip (FT2) is another part",
)
_REST = measured(
    243.0, "count", "clear-nus/icub_grasp_dataset: median 243, fingers 241-244, single taxels 236-246 (sd 2)"
)
_RATE = Source(
    tag="assumed",
    reference="the host's reader runs every 20 ms; boards send every 40 ms (host default) or 50 ms (firmware), "
    "and Karl et al. 2016 read the chip by their own converter",
)


def _taxel(number: int, x_mm: float, s_mm: float) -> ChannelSpec:
    angle = s_mm / OUTER_RADIUS_MM
    return ChannelSpec(
        name=f"T{number}",
        kind="taxel",
        lower=0.0,
        upper=255.0,
        rest=_REST,
        sign=-1,
        position_m=(
            x_mm * 1e-3,
            OUTER_RADIUS_MM * math.sin(angle) * 1e-3,
            -OUTER_RADIUS_MM * math.cos(angle) * 1e-3,
        ),
        normal=(0.0, math.sin(angle), -math.cos(angle)),
        position_source=_PLACE_SOURCE,
    )


STREAMS: tuple[StreamSpec, ...] = (
    StreamSpec(
        name="taxels",
        rate_hz=50.0,
        rate_source=_RATE,
        dtype="uint8",
        channels=tuple(_taxel(number, x, s) for number, (x, s) in enumerate(PLACES_MM, start=1)),
    ),
)
"""Streams of the fingertip: one, since all taxels are read on one clock."""

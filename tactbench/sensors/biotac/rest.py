"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median and their spread are those measured; see ``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    3000.8, 3131.3, 3266.3, 3238.3, 3315.7, 3260.3, 2848.1, 2901.6, 2901.6, 2949.4,
    3000.8, 3131.3, 3266.3, 3238.3, 3315.7, 3260.3, 3192.9, 3379.5, 3420.7,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

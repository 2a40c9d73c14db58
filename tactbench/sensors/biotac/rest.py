"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median is the measured one; their spread is the model's own answer; see
``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    3017.0, 3160.5, 3237.2, 3285.6, 3325.8, 3437.5, 2807.8, 2885.3, 2885.3, 2891.6,
    3017.0, 3160.5, 3237.2, 3285.6, 3325.8, 3437.5, 3035.6, 3276.6, 3481.5,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

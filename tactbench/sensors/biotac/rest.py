"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median is the measured one; their spread is the model's own answer; see
``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    2796.9, 3357.4, 3375.1, 2975.3, 3330.9, 2852.8, 3085.1, 3153.2, 3153.2, 3237.1,
    2796.9, 3357.4, 3375.1, 2975.3, 3330.9, 2852.8, 3352.3, 3398.6, 3359.3,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median is the measured one; their spread is the model's own answer; see
``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    2797.7, 3357.3, 3375.2, 2976.7, 3331.2, 2853.6, 3086.8, 3154.0, 3154.0, 3237.0,
    2797.7, 3357.3, 3375.2, 2976.7, 3331.2, 2853.6, 3353.2, 3399.1, 3359.3,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median is the measured one; their spread is the model's own answer; see
``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    2796.2, 3356.0, 3374.1, 2974.3, 3329.6, 2849.4, 3086.9, 3153.5, 3153.5, 3236.7,
    2796.2, 3356.0, 3374.1, 2974.3, 3329.6, 2849.4, 3351.7, 3397.1, 3357.0,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median is the measured one; their spread is the model's own answer; see
``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    3016.7, 3161.0, 3237.3, 3285.1, 3325.2, 3435.9, 2810.4, 2887.0, 2887.0, 2893.9,
    3016.7, 3161.0, 3237.3, 3285.1, 3325.2, 3435.9, 3037.0, 3277.1, 3479.8,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median and their spread are those measured; see ``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    3088.5, 3324.7, 3218.3, 3065.7, 3361.2, 3094.4, 3128.2, 3232.8, 3232.8, 3350.4,
    3088.5, 3324.7, 3218.3, 3065.7, 3361.2, 3094.4, 3431.4, 3451.1, 3576.9,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

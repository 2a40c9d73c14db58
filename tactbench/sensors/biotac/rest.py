"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest.

Not the measured levels electrode by electrode (no source lists them): the twin adds the model's change to these, so
both must come from one model. Their median and their spread are those measured; see ``docs/sensors.md``.
"""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (
    3094.2, 3329.3, 3223.0, 3070.9, 3366.4, 3099.1, 3132.7, 3238.1, 3238.1, 3354.9,
    3094.2, 3329.3, 3223.0, 3070.9, 3366.4, 3099.1, 3435.8, 3455.0, 3581.1,
)  # fmt: skip
"""Counts of E1 to E19 at the spec's default grid; a test computes them anew from the spec."""

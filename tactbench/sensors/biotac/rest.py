"""What the electrodes read with nothing touching: the conduction model's own answer for the film at rest."""

from __future__ import annotations

REST_COUNTS: tuple[float, ...] = (3200.0,) * 19
"""Counts of E1 to E19; a test computes them anew from the spec."""

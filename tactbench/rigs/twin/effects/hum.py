"""Hum: noise within a band, as a sensor's electronics and surroundings give it at rest."""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import FloatArray, RigError
from tactbench.rigs.twin.effects.memory import recurrence
from tactbench.rigs.twin.synthesis import Synthesis


def apply(run: Synthesis) -> None:
    """Add the sensor's ``hum`` (rms, counts) between ``hum_low`` and ``hum_high`` to its dynamic pressure."""
    stated = run.sensor.spec.parameters
    if "hum" not in stated:
        return
    scale = run.scene.environment.noise_scale
    for track in run.tracks:
        for column in track.by_kind().get("ac_pressure", []):
            track.readings[:, column] += band_noise(
                track.t_s,
                scale * stated["hum"].value,
                stated["hum_low"].to("Hz"),
                stated["hum_high"].to("Hz"),
                run.of_recording("hum", track.channels[column].name),
            )


def band_noise(
    t_s: FloatArray, spread: float, low_hz: float, high_hz: float, generator: np.random.Generator
) -> FloatArray:
    """Return (n,) Gaussian noise within a band, stationary from the first sample on, exact for any step.

    White noise through a first-order high-pass and a first-order low-pass, scaled to the standard deviation `spread`.
    Its density is ``f^2/((f^2 + l^2)(f^2 + h^2))`` up to a factor, with the corners ``l h = low high`` and
    ``l + h = high - low``: so that half of the peak is left at `low_hz` and at `high_hz`.

    Raises
    ------
    RigError
        If the band is narrower than ``high/low = 3 + 2 sqrt(2)``: first-order filters have none narrower.

    Notes
    -----
    The filter ``s/((s + p)(s + r))`` is the difference of two Ornstein-Uhlenbeck paths with rates p < r that one white
    noise drives: ``(r e_r - p e_p)/(r - p)``. Their increments over a step are normal with covariances
    ``(1 - a_i a_j)/(p_i + p_j)``, drawn by Cholesky's factor.
    """
    apart = (high_hz - low_hz) ** 2 - 4.0 * low_hz * high_hz
    if not (0 < low_hz < high_hz and apart > 0):
        raise RigError(
            f"A hum between {low_hz:g} and {high_hz:g} Hz cannot be made.",
            hint="hum_high must be at least 5.9 times hum_low, and both above 0.",
        )
    rates = math.pi * np.array([high_hz - low_hz - math.sqrt(apart), high_hz - low_hz + math.sqrt(apart)])
    weights = np.array([-rates[0], rates[1]]) / (rates[1] - rates[0])
    sums = rates[:, None] + rates[None, :]
    weights = weights / math.sqrt(float(weights @ (1.0 / sums) @ weights))
    dt = np.diff(t_s, prepend=t_s[:1])
    faded = np.exp(-dt[:, None] * rates)
    fresh = -np.expm1(-dt[:, None, None] * sums) / sums
    fresh[0] = 1.0 / sums
    first = np.sqrt(fresh[:, 0, 0])
    across = np.divide(fresh[:, 0, 1], first, out=np.zeros_like(first), where=first > 0)
    second = np.sqrt(np.maximum(fresh[:, 1, 1] - across**2, 0.0))
    numbers = generator.standard_normal((t_s.size, 2))
    paths = (first * numbers[:, 0], across * numbers[:, 0] + second * numbers[:, 1])
    return np.asarray(
        spread * sum(w * recurrence(faded[:, n], path) for n, (w, path) in enumerate(zip(weights, paths, strict=True)))
    )

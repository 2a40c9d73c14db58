"""A thermistor behind a converter: temperature to reading and back, both directions exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactbench.plugin import FloatArray, SensorSpec

_ICE_K = 273.15
NEEDED = ("thermistor_b", "thermistor_p", "thermistor_q")
"""Parameters of a sensor with a thermistor."""


@dataclass(frozen=True)
class Thermistor:
    """``T = b / ln((p - q x)/x) - 273.15`` degC, with x the reading over full scale.

    The form in which the maker of the BioTac states it (SynTouch BioTac SP product manual, section 5): a thermistor
    of exponent b in a divider.
    """

    b_k: float
    p: float
    q: float
    full_scale: float

    @classmethod
    def of(cls, sensor: SensorSpec, full_scale: float) -> Thermistor | None:
        """Return the thermistor that the spec declares; None without one."""
        if any(name not in sensor.parameters for name in NEEDED):
            return None
        b, p, q = (sensor.parameters[name] for name in NEEDED)
        return cls(b.to("K"), p.to("1"), q.to("1"), full_scale)

    def reading(self, degc: FloatArray) -> FloatArray:
        """Return the readings at temperatures: ``x = p / (exp(b/T) + q)``, T in kelvin."""
        # Above absolute zero by a kelvin: colder than that, the exponential overflows.
        kelvin = np.maximum(np.asarray(degc, dtype=np.float64) + _ICE_K, 10.0)
        return np.asarray(self.full_scale * self.p / (np.exp(self.b_k / kelvin) + self.q))

    def degc(self, reading: FloatArray) -> FloatArray:
        """Return the temperatures at readings strictly between 0 and full scale."""
        x = np.asarray(reading, dtype=np.float64) / self.full_scale
        return np.asarray(self.b_k / np.log((self.p - self.q * x) / x) - _ICE_K)

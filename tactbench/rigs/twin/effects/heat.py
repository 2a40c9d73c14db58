"""Effects of heat flow through the contact on the core, the temperature channels and the resistive channels.

Heated core as one thermal mass (with a heater and resistances to room and indenter), and its thermistor.

    C dT/dt = P + (T_room - T)/R + G (T_indenter - T)

With `Y = 1/R + G`, `T_inf = (P + T_room/R + G T_indenter)/Y` and `tau = C/Y`, a step of constant G is
``T' = T_inf + (T - T_inf) exp(-dt/tau)``: exact for any dt, so a step of a thousand tau ends at T_inf and dt = 0
changes nothing. G varies along a ramp: for each step the mean of its values at both ends is used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import ChannelKind, FloatArray, Scene, SensorSpec
from tactbench.rigs.twin.contact.stages import round_contact_mm
from tactbench.rigs.twin.effects.called_for import NEEDED, THERMISTOR
from tactbench.rigs.twin.effects.memory import lag, recurrence, time_constant_s
from tactbench.rigs.twin.synthesis import Synthesis, Track

_ICE_K = 273.15


def contact_heat(run: Synthesis) -> None:
    """Compute the temperature change of the core by heat flow between core and indenter through the contact's area."""
    core = HeatedCore.of(run.scene, run.sensor.spec)
    indenter = run.scene.environment.indenter_temperature
    conductivity = run.sensor.spec.parameters.get("contact_conductivity")
    if core is None or indenter is None or conductivity is None:
        return
    for track in run.tracks:
        # From an isothermal disc of radius a into a half-space: 4 k a (Carslaw and Jaeger 1959, Conduction of heat in
        # solids, chapter 8).
        conductance = 4e-3 * conductivity.to("W/m/K") * round_contact_mm(run, track.force_n)
        track.warmth_k = core.warmth(run.scene, track.t_s, conductance, indenter.to("degC"))


def dc_temperature(run: Synthesis) -> None:
    """Set the channels of steady temperature to the low-passed reading of the thermistor."""
    for track, column, reading in _thermistor(run, "dc_temperature"):
        rest = track.channels[column].rest
        # Tracks start at rest; the thermistor's formula gives the level of this core instead.
        track.readings[:, column] += reading - (0.0 if rest is None else rest.value)


def ac_temperature(run: Synthesis) -> None:
    """Add the high-passed, amplified reading of the thermistor to the channels of changing temperature."""
    stated = run.sensor.spec.parameters
    if "thermal_high_pass" not in stated or "thermal_gain" not in stated:
        return
    tau_s, gain = time_constant_s(stated["thermal_high_pass"].to("Hz")), stated["thermal_gain"].to("1")
    for track, column, reading in _thermistor(run, "ac_temperature"):
        track.readings[:, column] += gain * (reading - lag(track.t_s, reading, tau_s))


def _thermistor(run: Synthesis, kind: ChannelKind) -> Iterator[tuple[Track, int, FloatArray]]:
    """Yield each channel of a kind with the thermistor's (n,) readings in its counts; nothing without a thermistor."""
    core, low_pass = HeatedCore.of(run.scene, run.sensor.spec), run.sensor.spec.parameters.get("thermal_low_pass")
    for track, column in run.columns(kind):
        thermistor = Thermistor.of(run.sensor.spec, track.channels[column].upper or 1.0)
        if core is not None and thermistor is not None:
            degc = core.untouched(run.scene, track.t_s)
            reading = thermistor.reading(degc if track.warmth_k is None else degc + track.warmth_k)
            if low_pass is not None:
                reading = lag(track.t_s, reading, time_constant_s(low_pass.to("Hz")))
            yield track, column, reading


def thermal_drift(run: Synthesis) -> None:
    """Scale each reading's resistance by the ratio of the fluid's conductivities without and with the contact.

    This is the change by the contact only: the measured rise of readings while the core warms up is in the effect
    "warm-up".
    """
    core = HeatedCore.of(run.scene, run.sensor.spec)
    coefficient = run.sensor.spec.parameters.get("conductivity_coefficient")
    if core is None or coefficient is None:
        return
    per_k = coefficient.to("1/K")
    for track, column in run.columns("taxel"):
        upper = track.channels[column].upper
        if track.warmth_k is not None and upper is not None:
            untouched = core.untouched(run.scene, track.t_s)
            gained = relative_conductivity(untouched + track.warmth_k, per_k)
            gained = gained / relative_conductivity(untouched, per_k)
            track.readings[:, column] = through_divider(track.readings[:, column], gained, upper)


def through_divider(reading: FloatArray, gained: FloatArray, full_scale: float) -> FloatArray:
    """Return a voltage divider's reading ``E = top/(1 + R/R_ref)`` after its resistance falls by the factor `gained`.

    Readings at or beyond the ends (no resistance, or no conductance) stay as they are.
    """
    inside = (reading > 0) & (reading < full_scale)
    share = np.where(inside, reading, 0.0) / full_scale
    return np.where(inside, gained * reading / (1.0 + (gained - 1.0) * share), reading)


@dataclass(frozen=True)
class HeatedCore:
    """A heated core as one thermal mass."""

    room_c: float
    power_w: float
    resistance_k_per_w: float
    capacity_j_per_k: float

    @classmethod
    def of(cls, scene: Scene, sensor: SensorSpec) -> HeatedCore | None:
        """Return the heated core of the sensor's spec at the scene's room temperature; None for a spec without one."""
        if any(name not in sensor.parameters for name in NEEDED):
            return None
        return cls(
            room_c=scene.environment.ambient.to("degC"),
            power_w=sensor.parameters["heater_power"].to("W"),
            resistance_k_per_w=sensor.parameters["heat_resistance"].to("K/W"),
            capacity_j_per_k=sensor.parameters["heat_capacity"].to("J/K"),
        )

    @property
    def rise_k(self) -> float:
        """Final temperature of the heated core above the room's temperature, K."""
        return self.power_w * self.resistance_k_per_w

    @property
    def tau_s(self) -> float:
        """Time constant of the core's temperature without a contact, s."""
        return self.capacity_j_per_k * self.resistance_k_per_w

    def untouched(self, scene: Scene, t_s: FloatArray) -> FloatArray:
        """Return the core's temperature without a contact, degC, at (n,) seconds since the recording's first sample.

        At power-on it is the room's. The scene's ``drift_scale`` scales the remaining rise, as in the effect "warm-up".
        """
        environment = scene.environment
        since = environment.since_power_on.to("s") + scene.starts_after_s + t_s
        return self.room_c + self.rise_k * (1.0 - environment.drift_scale * np.exp(-since / self.tau_s))

    def warmth(self, scene: Scene, t_s: FloatArray, conductance_w_per_k: FloatArray, indenter_c: float) -> FloatArray:
        """Return the (n,) kelvin by which a contact warms the core: its temperature less that without a contact.

        `t_s` (n,) ascends, equal neighbours are allowed; `conductance_w_per_k` (n,) is that of the contact.
        """
        start = float(self.untouched(scene, t_s[:1])[0])
        untouched = self.carried(t_s, np.zeros_like(t_s), indenter_c, start)
        return self.carried(t_s, conductance_w_per_k, indenter_c, start) - untouched

    def carried(
        self, t_s: FloatArray, conductance_w_per_k: FloatArray, indenter_c: float, start_c: float
    ) -> FloatArray:
        """Return the (n,) temperatures of the core under the given contact, degC, from `start_c` on."""
        before = np.concatenate([conductance_w_per_k[:1], conductance_w_per_k[:-1]])
        through = 0.5 * (before + conductance_w_per_k)
        loss = 1.0 / self.resistance_k_per_w + through
        # Relative to the room: nothing cancels, and a core at rest stays there to the last digit.
        goal = (self.power_w + through * (indenter_c - self.room_c)) / loss
        exponent = -np.diff(t_s, prepend=t_s[:1]) * loss / self.capacity_j_per_k
        drive = -np.expm1(exponent) * goal
        drive[0] = start_c - self.room_c
        return self.room_c + recurrence(np.exp(exponent), drive)


def relative_conductivity(degc: FloatArray, coefficient_per_k: float) -> FloatArray:
    """Return the conductivity of an electrolyte relative to that at 25 degC: ``1 + alpha (T - 25)``.

    The result is at least 0.1, where the formula would leave the range of liquids (below -20 degC for 2 % per kelvin).
    """
    return np.maximum(1.0 + coefficient_per_k * (degc - 25.0), 0.1)


@dataclass(frozen=True)
class Thermistor:
    """A thermistor with ``T = b / ln((p - q x)/x) - 273.15`` degC, x being the reading over full scale.

    The formula is that of the BioTac's maker (SynTouch BioTac SP product manual, section 5) for a thermistor of
    exponent b in a voltage divider.
    """

    b_k: float
    p: float
    q: float
    full_scale: float

    @classmethod
    def of(cls, sensor: SensorSpec, full_scale: float) -> Thermistor | None:
        """Return the thermistor of a sensor's spec; None for a spec without one."""
        if any(name not in sensor.parameters for name in THERMISTOR):
            return None
        b, p, q = (sensor.parameters[name] for name in THERMISTOR)
        return cls(b.to("K"), p.to("1"), q.to("1"), full_scale)

    def reading(self, degc: FloatArray) -> FloatArray:
        """Return the readings [count] at temperatures [degC]: full scale times ``p / (exp(b/T) + q)``, T in kelvin."""
        # Above absolute zero by a kelvin: colder than that, the exponential overflows.
        kelvin = np.maximum(degc + _ICE_K, 10.0)
        return self.full_scale * self.p / (np.exp(self.b_k / kelvin) + self.q)

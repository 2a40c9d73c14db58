"""Which effects of heat a scene calls for; bounds in counts, without numerics on the skin."""

from __future__ import annotations

import math

import numpy as np

from tactbench.plugin import ChannelKind, Scene, SensorSpec
from tactbench.plugin.simulation import Reason, SkinSheet
from tactbench.rigs.twin.effects import thermistor
from tactbench.rigs.twin.effects.heated_core import NEEDED, HeatedCore

NOT_OBSERVED = "no observed channel depends on it"
_KINDS: tuple[ChannelKind, ...] = ("taxel", "dc_temperature", "ac_temperature")


def dc_temperature(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether somebody looks at a thermistor that the spec describes."""
    return _channel(scene, sensor, "dc_temperature", thermistor.NEEDED)


def ac_temperature(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether somebody looks at the rate of a thermistor that the spec describes."""
    return _channel(scene, sensor, "ac_temperature", (*thermistor.NEEDED, "thermal_high_pass", "thermal_gain"))


def contact_heat(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether a contact warms or cools the core by more than an observed channel would hide.

    Behind a contact of conductance G the core follows the indenter, D kelvin away, by at most ``D G t / C`` and never
    by more than D. G is at most that of a contact whose whole load stands as far out as the cap or the sheet allows.
    """
    observed = [kind for kind in _KINDS if kind in scene.observe]
    if not observed:
        return Reason(False, NOT_OBSERVED, 0.0)
    silent = _silent(scene, sensor)
    if silent is not None:
        return Reason(False, silent, 0.0)
    most_k = _most_k(scene, sensor)
    counts = {kind: _counts_per_k(kind, scene, sensor) * most_k for kind in observed}
    most = max(counts.values())
    text = f"{_apart(scene, sensor)}: the core moves by at most {most_k:.2g} K, a reading by {most:.2g} counts"
    hidden = [_hidden(kind, scene, sensor) for kind in observed]
    if all(count <= floor / 3 for count, floor in zip(counts.values(), hidden, strict=True)):
        return Reason(False, f"{text}, below a third of noise and rounding ({min(hidden):.2g})", most)
    return Reason(True, text, most)


def thermal_drift(scene: Scene, sensor: SensorSpec) -> Reason:
    """Answer whether resistive channels follow a core that the contact warms or cools."""
    if "taxel" not in scene.observe:
        return Reason(False, NOT_OBSERVED, 0.0)
    if "conductivity_coefficient" not in sensor.parameters:
        return Reason(False, "the spec states no coefficient of a fluid's conductivity", 0.0)
    silent = _silent(scene, sensor)
    if silent is not None:
        return Reason(False, silent, 0.0)
    per_k = sensor.parameters["conductivity_coefficient"]
    most = _counts_per_k("taxel", scene, sensor) * _most_k(scene, sensor)
    text = (
        f"conductivity changes by {100 * per_k.to('1/K'):g} % of that at 25 degC per kelvin: at most {most:.2g} counts"
    )
    hidden = _hidden("taxel", scene, sensor)
    if most <= hidden / 3:
        return Reason(False, f"{text}, below a third of noise and rounding ({hidden:.2g})", most)
    return Reason(True, text, most)


def _channel(scene: Scene, sensor: SensorSpec, kind: ChannelKind, needed: tuple[str, ...]) -> Reason:
    if kind not in scene.observe:
        return Reason(False, NOT_OBSERVED, 0.0)
    missing = [name for name in (*needed, *NEEDED) if name not in sensor.parameters]
    if missing:
        return Reason(False, f"the spec states no {', '.join(missing)}", 0.0)
    rise = sensor.parameters["heater_power"].to("W") * sensor.parameters["heat_resistance"].to("K/W")
    return Reason(True, f"an observed channel reads a core that its heater keeps {rise:.0f} K above the room")


def _silent(scene: Scene, sensor: SensorSpec) -> str | None:
    """Return why no heat can flow through the contact at all; None if it may."""
    missing = [name for name in (*NEEDED, "contact_conductivity") if name not in sensor.parameters]
    if missing:
        return f"the spec states no {', '.join(missing)}"
    if scene.environment.indenter_temperature is None:
        return "the scene's indenter is as warm as what it touches: 0 K apart"
    if not scene.profile.largest_n > 0:
        return "the scene has no load: 0 N throughout"
    return None


def _ends_c(scene: Scene, sensor: SensorSpec) -> tuple[float, float]:
    """Return the temperature of the untouched core at the scene's first and last moment: it moves one way only."""
    core = HeatedCore.of(scene, sensor)
    if core is None:
        return 25.0, 25.0
    first, last = core.untouched(scene, np.array([0.0, scene.profile.duration.to("s")]))
    return float(first), float(last)


def _difference_k(scene: Scene, sensor: SensorSpec) -> float:
    indenter = scene.environment.indenter_temperature
    return 0.0 if indenter is None else max(abs(end - indenter.to("degC")) for end in _ends_c(scene, sensor))


def _apart(scene: Scene, sensor: SensorSpec) -> str:
    return (
        f"indenter at {scene.environment.indenter_temperature} on a core of {_ends_c(scene, sensor)[0]:.1f} degC, "
        f"{_difference_k(scene, sensor):.2g} K apart"
    )


def widest_contact_mm(scene: Scene, sheet: SkinSheet) -> float:
    """Return what a contact's radius is never above, mm.

    It is sqrt(5/2) times the rms distance of the load from the apex. None of it stands beyond the sheet's other corner,
    nor beyond a cap's rim, which along the arc is at most pi/2 times as far as straight.
    """
    farthest = math.hypot(sheet.x_max.to("mm") - sheet.x_min.to("mm"), sheet.arc.to("mm"))
    if scene.indenter.radius is not None:
        farthest = min(farthest, math.pi / 2 * scene.indenter.radius.to("mm"))
    return math.sqrt(5 / 2) * farthest


def _most_k(scene: Scene, sensor: SensorSpec) -> float:
    sheet = None if sensor.skin is None else sensor.skin.sheet
    if sheet is None:
        return 0.0
    widest = widest_contact_mm(scene, sheet)
    conductance = 4e-3 * sensor.parameters["contact_conductivity"].to("W/m/K") * widest
    profile = scene.profile
    # A force loop touches the skin while it waits, too.
    idle = 0.0 if profile.start.to("N") > 0 or scene.drive is not None else profile.hold.to("s")
    pressed_s = max(profile.duration.to("s") - idle, 0.0)
    share = min(1.0, conductance * pressed_s / sensor.parameters["heat_capacity"].to("J/K"))
    return _difference_k(scene, sensor) * share


def _counts_per_k(kind: ChannelKind, scene: Scene, sensor: SensorSpec) -> float:
    """Return at most how far a channel of `kind` moves per kelvin of the core."""
    top = max(channel.upper or 1.0 for channel in sensor.channels(kind))
    if kind == "taxel":
        coefficient = sensor.parameters.get("conductivity_coefficient")
        if coefficient is None:
            return 0.0
        # d reading / d ln(conductivity) = top r/(1 + r)^2 <= top/4; relative to 25 degC, so most where it is coldest.
        indenter = scene.environment.indenter_temperature
        coldest = min(*_ends_c(scene, sensor), 25.0 if indenter is None else indenter.to("degC"))
        return top / 4 * coefficient.to("1/K") / max(1.0 + coefficient.to("1/K") * (coldest - 25.0), 0.1)
    if "thermistor_b" not in sensor.parameters:
        return 0.0
    # x = p/(exp(b/T) + q): d x / d T = x (1 - x q/p) b/T^2 <= p/(4 q) b/T^2; nothing is colder than 250 K here.
    p, q, b = (sensor.parameters[f"thermistor_{name}"].value for name in "pqb")
    slope = top * p / (4 * q) * b / 250.0**2
    if kind == "dc_temperature":
        return slope
    gain = sensor.parameters.get("thermal_gain")
    # The high-pass gives its input less a mean of its past: at most the input's whole range.
    return 0.0 if gain is None else slope * gain.to("1")


def _hidden(kind: ChannelKind, scene: Scene, sensor: SensorSpec) -> float:
    nuisances = sensor.nuisances.get(kind)
    return 0.0 if nuisances is None else nuisances.hidden(scene.environment.noise_scale)

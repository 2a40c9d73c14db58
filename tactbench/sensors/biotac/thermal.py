"""Thermal parameters of the BioTac: heated core, thermistor, and conductivity of the fluid.

Lumped: one temperature for core, fluid and skin. What is known are the thermistor's formula, its rest, its band and
its gain, and the time constant of the shared warm-up; the flow of heat into an indenter is assumed.
"""

from __future__ import annotations

import math

from tactbench.plugin import Quantity, assumed, derived, sourced
from tactbench.sensors.biotac.channels import CONVERTER_TOP, MANUAL

_TDC_REST = 2576.0
_B, _P, _Q = 4025.0, 155183.0, 46555.0
_REST_DEGC = _B / math.log((_P - _Q * _TDC_REST / CONVERTER_TOP) / (_TDC_REST / CONVERTER_TOP)) - 273.15
_ROOM_DEGC = 23.0
_HEATER_W = 0.25
_WARM_UP_S = 500.0
_RESISTANCE = (_REST_DEGC - _ROOM_DEGC) / _HEATER_W

_FORMULA = f"T = b / ln((p - q x)/x) - 273.15 degC with x = reading/4095; {MANUAL}"

THERMAL: dict[str, Quantity] = {
    "thermistor_b": sourced(_B, "K", _FORMULA),
    "thermistor_p": sourced(_P, "1", _FORMULA),
    "thermistor_q": sourced(_Q, "1", _FORMULA),
    "thermal_low_pass": sourced(22.6, "Hz", f"upper end of the band of TDC and TAC; {MANUAL}"),
    "thermal_high_pass": sourced(
        0.45, "Hz", f"lower end of the band of TAC in the table, 0.25 Hz in the text; {MANUAL}"
    ),
    "thermal_gain": sourced(98.0, "1", f"TAC against TDC; {MANUAL}. Order and shape of the filters are assumed"),
    "heater_power": assumed(
        _HEATER_W,
        "W",
        "the maker says that the embedded electronics heat the core, not how much; scales all heat flows",
    ),
    "heat_resistance": derived(
        _RESISTANCE, "K/W", f"core to room: {_REST_DEGC:.1f} degC, as TDC rests, over {_ROOM_DEGC:g} degC by that power"
    ),
    "heat_capacity": derived(
        _WARM_UP_S / _RESISTANCE, "J/K", f"core: the measured warm-up of {_WARM_UP_S:g} s over that resistance"
    ),
    "contact_conductivity": assumed(
        0.2,
        "W/m/K",
        "silicone; the flow through a contact of radius a is 4 k a (Carslaw and Jaeger 1959, isothermal disc)",
    ),
    "conductivity_coefficient": assumed(
        0.02,
        "1/K",
        "at 25 degC, where salts in water gain about 2 % per kelvin (Robinson and Stokes 1959); NaBr not told",
    ),
}

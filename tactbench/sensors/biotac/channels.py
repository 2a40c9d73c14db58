"""The channels of the BioTac: two clocks, 22 channels at 100 Hz and one at 2200 Hz."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from tactbench.plugin import (
    ChannelKind,
    ChannelSpec,
    PhysicalRange,
    Quantity,
    Source,
    StreamSpec,
    derived,
    measured,
    sourced,
)

PAPER = "Karl et al. 2016, table I"
MANUAL = "SynTouch BioTac SP product manual (26 Oct 2015), section 5, said to hold for the BioTac's electronics"
SHEET_2011 = "The 2011 data sheet disagrees"
FRAME = Source(
    tag="sourced",
    reference="kth-ros-pkg/biotac_driver: default frame of 44 commands at 4400 samples/s, every second one PAC",
)
CONVERTER_TOP = 4095.0
"""Largest reading [count] of the BioTac's 12-bit converter; source: kth-ros-pkg/biotac_driver."""

# One table of electrodes is in TAMS-Group/biotac_gazebo_plugin (``sim_biotac.h``) and clear-nus/biotac_driver
# (``biotac_logger_v3.py``): millimetres, x towards the tip, -z towards the pad, outward normals.
TABLE = Source(
    tag="sourced",
    reference="TAMS-Group/biotac_gazebo_plugin sim_biotac.h, identical in clear-nus/biotac_driver "
    "biotac_logger_v3.py; normals printed there with three decimals, made exactly unit here",
)


class Electrode(NamedTuple):
    """Position [mm] and outward normal of one electrode."""

    x_mm: float
    y_mm: float
    z_mm: float
    normal: tuple[float, float, float]


_SIDE = (0.0, -0.976, -0.220)
_LOWER = (0.0, -0.692, -0.722)
_FACET = (0.5, 0.0, -0.866)
_MIDLINE = (0.0, 0.0, -1.0)

# Electrodes 1-6; 11-16 are their mirror images in y.
_FLANK = (
    (0.993, -4.855, -1.116, (0.196, -0.956, -0.220)),
    (-2.700, -3.513, -3.670, _LOWER),
    (-6.200, -3.513, -3.670, _LOWER),
    (-8.000, -4.956, -1.116, _SIDE),
    (-10.500, -3.513, -3.670, _LOWER),
    (-13.400, -4.956, -1.116, _SIDE),
)
ELECTRODES = tuple(
    Electrode(*place)
    for place in (
        *_FLANK,
        (4.763, 0.000, -2.330, _FACET),
        (3.031, -1.950, -3.330, _FACET),
        (3.031, 1.950, -3.330, _FACET),
        (1.299, 0.000, -4.330, _FACET),
        *((x, -y, z, (along, -across, up)) for x, y, z, (along, across, up) in _FLANK),
        (-2.800, 0.000, -5.080, _MIDLINE),
        (-9.800, 0.000, -5.080, _MIDLINE),
        (-13.600, 0.000, -5.080, _MIDLINE),
    )
)
"""The BioTac's electrodes 1 to 19, in order of their numbers."""

NAMES: tuple[str, ...] = tuple(f"E{number}" for number in range(1, len(ELECTRODES) + 1))
"""Names of the electrodes' channels, E1 to E19, in order of their numbers."""

REST_COUNTS: tuple[float, ...] = (
    2796.2, 3356.0, 3374.1, 2974.3, 3329.6, 2849.4, 3086.9, 3153.5, 3153.5, 3236.7,
    2796.2, 3356.0, 3374.1, 2974.3, 3329.6, 2849.4, 3351.7, 3397.1, 3357.0,
)  # fmt: skip
"""Readings of E1 to E19 without contact, computed by the conduction model for the film at rest on the spec's default
grid; a test recomputes them.

These are not the measured levels of single electrodes, which no source lists: the twin adds the model's change to them,
so both must come from one model. Their median is the measured median; their spread is that of the model; see
``docs/sensors.md``.
"""
_REST_FROM = (
    "computed by the conduction model of this sensor with the film at rest, so that readings at rest and under load "
    "belong together (docs/sensors.md); measured on real recordings: 2990-3461, median 3237"
)


def _stated(lower: float, upper: float, unit: str, reference: str) -> PhysicalRange:
    return PhysicalRange(lower=lower, upper=upper, unit=unit, source=Source(tag="sourced", reference=reference))


def _unit(normal: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = normal
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length)


def _converted(name: str, kind: ChannelKind, rest: Quantity, **more: Any) -> ChannelSpec:
    return ChannelSpec(name=name, kind=kind, lower=0.0, upper=CONVERTER_TOP, rest=rest, **more)


def _electrode(name: str, place: Electrode, rest: float) -> ChannelSpec:
    return _converted(
        name,
        "taxel",
        derived(rest, "count", _REST_FROM),
        # Falls under the contact, where the film thins; rises elsewhere, where the fluid goes.
        sign=0,
        position_m=(place.x_mm * 1e-3, place.y_mm * 1e-3, place.z_mm * 1e-3),
        normal=_unit(place.normal),
        position_source=TABLE,
        scale=derived(3.3 / CONVERTER_TOP, "V", f"3.3 V over 4095 counts; {MANUAL}"),
        measures=_stated(0.0, 3.3, "V", MANUAL),
        band=_stated(0.0, 100.0, "Hz", MANUAL),
    )


_PDC = _converted(
    "PDC",
    "dc_pressure",
    measured(2500.0, "count", "2404-2460 on one BioTac, 2583-2593 on two BioTac SP"),
    sign=1,
    scale=sourced(36.5, "Pa/count", MANUAL),
    measures=_stated(0.0, 100.0, "kPa", f"{PAPER}; the same in {MANUAL} and in the 2011 data sheet"),
    band=_stated(0.0, 1040.0, "Hz", MANUAL),
)
# Counts rise with temperature, not with load: 4025 / ln((155183 - 46555 x)/x) - 273.15 degC with x = TDC/4095.
_TDC = _converted(
    "TDC",
    "dc_temperature",
    measured(2576.0, "count", "2559-2592 on BioTac SP, about 57 degC: the core is heated"),
    measures=_stated(0.0, 75.0, "degC", f"{PAPER}; the same in {MANUAL}. {SHEET_2011}: 0-80 degC"),
    band=_stated(0.0, 22.6, "Hz", MANUAL),
)
# No physical range: the maker's formula gives -3 degC/s at mid-scale, outside its own 0-1 degC/s.
_TAC = _converted(
    "TAC",
    "ac_temperature",
    measured(2037.0, "count", "2032-2042 on BioTac SP"),
    band=_stated(0.45, 22.6, "Hz", f"{PAPER}; {MANUAL} has 0.45 Hz in its table and 0.25 Hz in its text"),
)
_PAC = _converted(
    "PAC",
    "ac_pressure",
    measured(2043.0, "count", "2040-2045 on BioTac SP"),
    scale=sourced(0.37, "Pa/count", MANUAL),
    measures=_stated(-0.76, 0.76, "kPa", f"{MANUAL}. {SHEET_2011}: +-2 kPa"),
    band=_stated(10.0, 1040.0, "Hz", f"{PAPER}; the same in {MANUAL}. {SHEET_2011}: 20-2200 Hz"),
)

STREAMS: tuple[StreamSpec, ...] = (
    StreamSpec(
        name="electrodes",
        rate_hz=100.0,
        rate_source=FRAME,
        dtype="uint16",
        channels=(
            *(_electrode(name, place, rest) for name, place, rest in zip(NAMES, ELECTRODES, REST_COUNTS, strict=True)),
            _PDC,
            _TDC,
            _TAC,
        ),
    ),
    StreamSpec(name="vibration", rate_hz=2200.0, rate_source=FRAME, dtype="uint16", channels=(_PAC,)),
)
"""Streams of the BioTac, one per rate: a frame of 10 ms holds every channel once and PAC 22 times."""

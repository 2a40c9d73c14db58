"""The BioTac: 19 electrodes under a fluid film, with pressure and temperature (see ``docs/sensors.md``).

The figures are measured on public recordings of one BioTac (Alexis-Georganopoulos/Robotic-Finger, called RF), of
another one sliding (dexrob/BioTac_slide_20_50, DX) and of three BioTac SP at rest (RuihanGao/BioTacSP_setup, RG).
Warm-up, effects of earlier contacts and random differences between recordings are separated: rest levels are compared
without the fitted warm-up, and 15 s or more after a contact. After-effects of hard presses are a scenario.
"""

from __future__ import annotations

import math

from tactbench.plugin import (
    ChannelKind,
    DataSheet,
    PhysicalRange,
    Quantity,
    SensorDescriptor,
    SensorSpec,
    Source,
    Statement,
    assumed,
    derived,
    hookimpl,
    measured,
    sourced,
)
from tactbench.plugin.simulation import Creep, Dome, FluidBackedShell, Nuisances, Scenario, SkinSheet, ranges
from tactbench.sensors.biotac.channels import CONVERTER_TOP, MANUAL, STREAMS
from tactbench.sensors.biotac.meshes import ELECTRODES_MM, MESHES, film_table, relief_table

_OUTER_MM, _DOME_MM, _SKIN_MM = 7.8, 1.4, 1.6
SKIN = FluidBackedShell(
    sheet=SkinSheet(
        x_min=derived(-17.2, "mm", f"the seal, where the film ends; {MESHES}"),
        x_max=derived(_DOME_MM + _OUTER_MM, "mm", "the dome's end"),
        arc=derived(math.pi * _OUTER_MM, "mm", "half of the circumference at the outer radius"),
        dome=Dome(
            start=derived(
                _DOME_MM,
                "mm",
                f"so that the dome ends where the skin does, core 7.13, film .45 and skin 1.6 mm: 9.2 mm; {MESHES}",
            ),
        ),
        outer_radius=derived(
            _OUTER_MM, "mm", f"of a cylinder with as long an arc from flank to flank: 24.2-24.7 mm; {MESHES}"
        ),
        relief=relief_table(_OUTER_MM, _DOME_MM, _SKIN_MM),
        cells=(64, 64),
    ),
    young=assumed(0.8, "MPa", "silicone of the skin alone; 0.4-1.55 tried. Shore A 26 by the maker"),
    poisson=assumed(0.48, "1", "nearly incompressible silicone"),
    thickness=derived(_SKIN_MM, "mm", f"{MESHES}: inner 6.47-6.69, outer 8.08-8.31 mm"),
    mid_radius=derived(
        6.31,
        "mm",
        f"outer surface, a circle of 7.11 mm about 1.1 mm below the core's axis, less half of the thickness; {MESHES}",
    ),
    tension=assumed(0.02, "N/mm", "no source"),
    contact_stiffness=assumed(1.299, "MPa/mm", "2 E / ((1 - nu^2) t); the factor 2 has no source"),
    core_stiffness=assumed(6.0, "MPa/mm", "penalty, stiff beside the skin"),
    film=film_table(_OUTER_MM, _DOME_MM),
    residual_film=assumed(0.06, "mm", "asperities of the inner skin keep a film open at touch-down"),
    clamp_stiffness=assumed(
        3.3,
        "MPa/mm",
        "clamp instead of the real seal, seam and nail; the value at which the largest rise under a plate is 0.45 per "
        "count of pressure (200-350 counts), as measured. It stands for what holds and stretches the real skin, too",
    ),
    clamp_length=assumed(1.0, "mm", "soft clamp instead of the real seal, seam and nail"),
)

_EXCITATION = (
    "shadow-robot/sr-visualization sr_gui_biotac biotac.py, map of 19 sensing and 4 excitation electrodes: its axial "
    "coordinate is 8.58 mm - x and its other 4.78 mm per radian, to the printed digit, for every electrode off the dome"
)

# Heated core, thermistor and conductivity of the fluid, lumped: one temperature for core, fluid and skin. The
# thermistor's formula, its rest, its band and its gain, and the time constant of the shared warm-up are known; the flow
# of heat into an indenter is assumed.
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
        "at 25 degC, where salts in water gain about 2 % per kelvin (Robinson and Stokes 1959); NaBr not stated",
    ),
}

PARAMETERS: dict[str, Quantity] = {
    "contact_x": assumed(-5.0, "mm", "middle of the pad; the paper does not state where its caps touch"),
    "contact_s": assumed(0.0, "mm", "on the midline"),
    "core_radius": sourced(
        ELECTRODES_MM, "mm", "radius on which the electrode table lies, e.g. sqrt(3.513^2 + 3.670^2)"
    ),
    "conductivity": assumed(
        0.391, "S/m", "NaBr solution; the value at which the median electrode rests at 3237 counts, as measured"
    ),
    "reference_resistor": sourced(10e3, "ohm", f"10 kOhm; {MANUAL}"),
    "electrode_radius": assumed(0.6, "mm", "no source"),
    "excitation_radius": assumed(0.8, "mm", "no source"),
    "excitation_x_front": derived(-3.9, "mm", f"12.48 mm on the map; {_EXCITATION}"),
    "excitation_x_back": derived(-15.9, "mm", f"24.48 mm on the map; {_EXCITATION}"),
    "excitation_arc_front": derived(6.85, "mm", f"arc on the core, 6.45 mm on the map: 77 degrees; {_EXCITATION}"),
    "excitation_arc_back": derived(3.99, "mm", f"arc on the core, 3.75 mm on the map: 45 degrees; {_EXCITATION}"),
    "skin_mode_frequency": derived(
        330.0, "Hz", "Fishel and Loeb 2012: the smallest vibrations are felt near 330 Hz; read as the skin's mode"
    ),
    "skin_mode_damping": assumed(0.1, "1", "share of the critical damping; no source"),
    "skin_lift": assumed(
        0.03, "1", "normal over tangential motion: x^2/(2 Ro) of a patch moved by x on a round finger, at 0.25 mm"
    ),
    "hum": measured(
        4.1, "count", "PAC of three BioTac SP at rest (RuihanGao/BioTacSP_setup): sd 4.5-5.1 in all, 2.4 of it white"
    ),
    "hum_low": measured(30.0, "Hz", "the same: the hum sits between 30 and 200 Hz"),
    "hum_high": measured(200.0, "Hz", "the same: the hum sits between 30 and 200 Hz"),
    **THERMAL,
}

_STEP = measured(1.0, "count", "raw channels of RF, DX and RG move in steps of one count")

_CREEP = (
    Creep(
        fraction=derived(0.05, "1", "RF: 0.11-0.12 of the response remains after release; the split is assumed"),
        tau=measured(1.6, "s", "static holds of a BioTac SP (yayaneath/BioTacSP-DoS): 1.6 s [0.5, 6]"),
    ),
    Creep(
        fraction=derived(0.06, "1", "RF: 0.11-0.12 of the response remains after release; the split is assumed"),
        tau=measured(7.0, "s", "RF: relaxation after release, 6.5-7.9 s; the slower tail is not identifiable"),
    ),
)


_WARM_UP_TAU = measured(500.0, "s", "RF: 450-620 s by three ways of fitting the shared drift")

TAXEL = Nuisances(
    white=measured(0.35, "count", "RF: 0.33 before rounding; 0.3-0.7 with DX. A BioTac SP shows 3.5-6, heavy-tailed"),
    offset_shared=measured(
        1.0, "count", "RF: 0.7-1.3 beyond the warm-up, 15 s or more after a contact; few intervals: 0.5-3"
    ),
    offset_own=measured(
        2.0, "count", "RF: 1-2 over minutes with two brief presses; DX: 0.9 after one touch; few intervals: 1-3"
    ),
    offset_smooth=derived(
        0.86,
        "1",
        "RF: a quadratic over the finger explains 87-93 % of the own part, and 28 % (5 of 18) of white noise by its "
        "own five coefficients: (0.90 - 0.28) / (1 - 0.28)",
    ),
    offset_session=measured(
        150.0, "count", "3dperceptionlab/biotacsp-stability-set-v2: 15-250 between sessions of BioTac SP"
    ),
    gain_scatter=derived(0.05, "1", "RF: mirror electrodes agree to 4-5 % after a common left-right factor"),
    warm_up=measured(90.0, "count", "RF: 70-110 counts, shared by all electrodes (94 % of the drift's variance)"),
    warm_up_tau=_WARM_UP_TAU,
    warm_up_scatter=measured(0.15, "1", "RF: electrodes follow the shared drift with factors of +-10-20 %"),
    wander=measured(
        0.1, "count", "RF: at most 0.085 about a straight line over 38 s without contact, white noise alone 0.033"
    ),
    wander_tau=assumed(5.0, "s", "not identifiable; the rise of the Allan deviation at rest is that of the warm-up"),
    step=_STEP,
    creep=_CREEP,
    unit_gain=assumed(
        0.1, "1", "not identifiable, no source presses two units with a known force; twice the scatter within one"
    ),
    unit_rest_shared=measured(158.0, "count", "RG: sd of the medians of three BioTac SP, 3020, 2989, 2733"),
    unit_rest_own=measured(
        125.0, "count", "RG: two BioTac SP differ by sd 87, the third by 163 after a shift; the middle"
    ),
)

PDC = Nuisances(
    white=measured(0.15, "count", "RF and RG: 0.12 before rounding on the quiet ones, 0.44 on one of RG"),
    offset_own=measured(17.0, "count", "RF: +17 to +20 after a minute of presses, back only over minutes"),
    warm_up=derived(
        20.0, "count", "RF: +5.0 where the electrodes rose by +23.1 without a contact, times their 90 counts"
    ),
    warm_up_tau=_WARM_UP_TAU,
    step=_STEP,
)


NUISANCES: dict[ChannelKind, Nuisances] = {
    "taxel": TAXEL,
    "dc_pressure": PDC,
    "dc_temperature": Nuisances(white=measured(0.4, "count", "RG 0.36-0.41, DX 0.45"), step=_STEP),
    "ac_temperature": Nuisances(white=measured(0.8, "count", "RG 0.7, DX 1.0"), step=_STEP),
    "ac_pressure": Nuisances(
        white=measured(2.4, "count", "RG, robust; the hum on top is the sensor's parameter `hum`"), step=_STEP
    ),
}

RANGES = ranges(
    ("noise_scale", 0.9, 2.1, "1", "measured", "0.33-0.72 counts on RF and DX, 0.35 here; BioTac SP: 3.5-6"),
    ("offset_scale", 0.0, 3.0, "1", "measured", "0: each recording tared; RF: 0.5-3 shared, 1-3 own; 1 and 2 here"),
    ("since_power_on_s", 60.0, 3600.0, "s", "assumed", "just switched on … warm; the paper does not say"),
    ("taxel_wander_count", 0.0, 0.5, "count", "measured", "RF: at most 0.085 untouched; 0.5 between presses"),
    ("taxel_gain_scatter", 0.0, 0.1, "1", "assumed", "none … twice what mirror electrodes of RF agree to"),
    ("taxel_offset_smooth", 0.0, 0.9, "1", "measured", "0: each electrode by itself; RF: 0.87-0.93, corrected"),
    ("taxel_creep_1_fraction", 0.0, 0.12, "1", "derived", "RF: 0.11-0.12 of the response remains after release"),
    ("placement_x_mm", -1.8, 1.8, "mm", "assumed", "half of a pad; the paper does not say where its caps touch"),
)
"""Plausible ranges of the BioTac's nuisances; factors refer to the nuisances' default values."""

HARD_HANDLED = Scenario(
    title="pressed hard for a minute, minutes before",
    nuisances={
        "taxel": TAXEL.model_copy(
            update={
                "offset_shared": measured(
                    15.0, "count", "RF: 10-20 between recordings 1-6 minutes apart, hard presses between them"
                ),
                "offset_own": measured(5.0, "count", "RF: 2-10 within a session, hard presses in between"),
                "offset_smooth": assumed(0.0, "1", "each electrode by itself, as these levels were used"),
                "wander": measured(0.5, "count", "RF: what is left over 38 s between presses"),
                "wander_tau": derived(5.0, "s", "RF: with 0.5 counts (sd) the Allan deviation rises as at rest"),
            }
        ),
        "dc_pressure": PDC.model_copy(
            update={
                "warm_up": derived(
                    100.0, "count", "RF: +56 where the electrodes rose by +50 on average, presses in between"
                )
            }
        ),
    },
)
"""Scenario with nuisances measured between recordings with hard presses, warm-up included. The offsets are
larger than in a usual session, and are an upper bound of the effect of such handling."""

_SP_MANUAL = "SynTouch BioTac SP product manual (26 Oct 2015), which says that the BioTac speaks the same protocol"
# Mass, supply power, height and availability: no source read so far states them.
DATA_SHEET = DataSheet(
    force_range=PhysicalRange(
        lower=0.1,
        upper=30.0,
        unit="N",
        source=Source(
            tag="sourced",
            reference="Wettels, Santos, Johansson, Loeb 2008, abstract: impedance over 0.1-30 N, on the prototype; "
            "largest load by the BioTac SP's product manual: 250 N",
        ),
    ),
    length=derived(29.0, "mm", f"core of 26.95 mm, film .45 and skin 1.6 mm at the tip; no mount; {MESHES}"),
    width=derived(16.2, "mm", f"twice the skin's outer radius of 8.08-8.31 mm, the smaller; {MESHES}"),
    interface=Statement(
        text="SPI mode 0, 0.5-10 MHz, 2-byte words with parity; supply 3.3-5 V",
        source=Source(tag="sourced", reference=f"{_SP_MANUAL}, sections 7 and 8.2; kth-ros-pkg/biotac_driver: mode 0"),
    ),
)

SPEC = SensorSpec(
    name="biotac",
    title="SynTouch BioTac",
    principle="resistive",
    principle_source=Source(tag="sourced", reference="Karl et al. 2016, table I"),
    streams=STREAMS,
    link_delay=sourced(
        10.0,
        "ms",
        "kth-ros-pkg/biotac_driver: the host collects batches of whole frames of 44 samples at 4400 samples/s; its ROS "
        "node one frame at a time, its default is five, 50 ms. The last word's own time on SPI is 0.07 ms of it",
    ),
    skin=SKIN,
    parameters=PARAMETERS,
    nuisances=NUISANCES,
    scenarios={"hard-handled": HARD_HANDLED},
    ranges=RANGES,
    data_sheet=DATA_SHEET,
    references=(
        "Karl et al. 2016, ML-based tactile sensor calibration: A universal approach",
        "Wettels, Santos, Johansson, Loeb 2008 (impedance of the electrodes)",
        "SynTouch BioTac SP product manual, 26 Oct 2015",
        "TAMS-Group/biotac_gazebo_plugin, clear-nus/biotac_driver (electrode table)",
        "NVlabs/biotac_sim (meshes of core and skin)",
        "shadow-robot/sr-visualization (map of the excitation electrodes)",
    ),
)


TACTBENCH_API = 2


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Return the descriptor of the BioTac."""
    return [
        SensorDescriptor(
            spec=SPEC,
            transducer="tactbench.sensors.biotac.transduction:build",
            driver="tactbench.sensors.biotac.driver:BioTacDriver",
            emulator="tactbench.sensors.biotac.emulator:build_emulator",
            emulated_link="spi",
            log_reader="tactbench.sensors.biotac.text_log:read_log",
        )
    ]

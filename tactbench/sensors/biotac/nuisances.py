"""Noise, drift and other nuisances of the BioTac, by kind of channel.

The figures are measured on public recordings of one BioTac (Alexis-Georganopoulos/Robotic-Finger, called RF), of
another one sliding (dexrob/BioTac_slide_20_50, DX) and of three BioTac SP at rest (RuihanGao/BioTacSP_setup, RG).
Warm-up, effects of earlier contacts and random differences between recordings are separated: rest levels are compared
without the fitted warm-up, and 15 s or more after a contact. After-effects of hard presses are a scenario.
"""

from __future__ import annotations

from tactbench.plugin import ChannelKind, assumed, derived, measured
from tactbench.plugin.simulation import Creep, Nuisances, Scenario, ranges

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

"""The iCub fingertip: 12 capacitive taxels under foam (see ``docs/sensors.md``)."""

from __future__ import annotations

import math

from tactbench.plugin import (
    ChannelSpec,
    DataSheet,
    Quantity,
    SensorDescriptor,
    SensorSpec,
    Source,
    Statement,
    StreamSpec,
    assumed,
    derived,
    hookimpl,
    measured,
    sourced,
)
from tactbench.plugin.simulation import Creep, FoamPad, Nuisances, SkinSheet, ranges

OUTER_RADIUS_MM = 6.5
"""Radius of the fingertip's outer surface: half of the width of 13 mm that Schmitz et al. 2010 state."""

PLACES_MM: tuple[tuple[float, float], ...] = (
    (6.0, 0.0), (4.0, -2.4), (4.0, 2.4), (1.5, 0.0), (1.0, -4.2), (1.0, 4.2),
    (-1.6, -1.9), (-1.6, 1.9), (-2.6, -5.2), (-2.6, 5.2), (-5.0, -2.2), (-5.0, 2.2),
)  # fmt: skip
"""Places (axial towards the tip, along the arc) of the taxels T1 to T12 on the outer surface; assumed."""

_PLACE_SOURCE = Source(
    tag="assumed",
    reference="laid out to cover the pad; robotology/icub-main's left_hand_V2_1.txt has zeros for the fingertips, "
    "and the published table of the newer fingertip (FT2) is another part",
)
_REST = measured(
    243.0, "count", "clear-nus/icub_grasp_dataset: median 243, fingers 241-244, single taxels 236-246 (sd 2)"
)
_RATE = Source(
    tag="assumed",
    reference="the host's reader runs every 20 ms; boards send every 40 ms (host default) or 50 ms (firmware), "
    "and Karl et al. 2016 read the chip by their own converter",
)


def _taxel(number: int, x_mm: float, s_mm: float) -> ChannelSpec:
    angle = s_mm / OUTER_RADIUS_MM
    return ChannelSpec(
        name=f"T{number}",
        kind="taxel",
        lower=0.0,
        upper=255.0,
        rest=_REST,
        sign=-1,
        position_m=(
            x_mm * 1e-3,
            OUTER_RADIUS_MM * math.sin(angle) * 1e-3,
            -OUTER_RADIUS_MM * math.cos(angle) * 1e-3,
        ),
        normal=(0.0, math.sin(angle), -math.cos(angle)),
        position_source=_PLACE_SOURCE,
    )


STREAMS: tuple[StreamSpec, ...] = (
    StreamSpec(
        name="taxels",
        rate_hz=50.0,
        rate_source=_RATE,
        dtype="uint8",
        channels=tuple(_taxel(number, x, s) for number, (x, s) in enumerate(PLACES_MM, start=1)),
    ),
)
"""Streams of the fingertip: one, since all taxels are read on one clock."""

_SCHMITZ = "Schmitz et al. 2010, abstract"
_GRASP = "clear-nus/icub_grasp_dataset, 279 loaded fingertips"
_ARC_MM = math.pi * OUTER_RADIUS_MM

SKIN = FoamPad(
    sheet=SkinSheet(
        x_min=derived(-9.25, "mm", f"pad of 14.5 mm ({_SCHMITZ}) and 2 mm of soft margin"),
        x_max=derived(9.25, "mm", f"pad of 14.5 mm ({_SCHMITZ}) and 2 mm of soft margin"),
        arc=derived(_ARC_MM, "mm", "half of the circumference"),
        outer_radius=derived(OUTER_RADIUS_MM, "mm", f"half of the width of 13 mm; {_SCHMITZ}"),
        cells=(46, 50),
        pad=(
            derived(-7.25, "mm", f"half of the length of 14.5 mm; {_SCHMITZ}"),
            derived(7.25, "mm", f"half of the length of 14.5 mm; {_SCHMITZ}"),
            derived(_ARC_MM, "mm", "no margin along the arc"),
        ),
    ),
    young=assumed(0.12, "MPa", "oedometric modulus of the silicone foam; 0.06-0.24 tried"),
    shear=assumed(0.05, "MPa", "no source"),
    thickness=assumed(2.0, "mm", "working value; no source states it"),
    densification=assumed(0.75, "1", "strain at which the foam is solid; no source"),
    cover_tension=assumed(0.015, "N/mm", "no source"),
    cover_bending=assumed(0.006, "N*mm", "no source"),
    contact_stiffness=assumed(
        10.8, "MPa/mm", "180 E/h: a stiff penalty, whose penetration is taken back; not a material value"
    ),
)

PARAMETERS: dict[str, Quantity] = {
    "contact_x": assumed(-0.3, "mm", "middle of the pad; the paper does not state where its caps touch"),
    "contact_s": assumed(0.0, "mm", "on the midline"),
    "taxel_radius": assumed(1.25, "mm", "half width of the flat-topped weight of a taxel; no source"),
    "gain": assumed(
        60.0, "count", f"fall of the reading when the capacitance doubles; gives the size measured on {_GRASP}"
    ),
    "least_gap": assumed(0.05, "1", "share of the foam's thickness below which the plates cannot come"),
    "rest_spread": measured(2.0, "count", f"standard deviation of the rest level over taxels; {_GRASP}"),
}

NUISANCES = Nuisances(
    white=measured(0.35, "count", f"0.30-0.38 before rounding; {_GRASP}"),
    offset_shared=assumed(0.0, "count", "the measured offsets are each taxel's own"),
    offset_own=measured(0.2, "count", f"within a session: 0.20 [0.07, 0.48]; {_GRASP}"),
    offset_session=measured(0.8, "count", f"between sessions: 0.78 [0.44, 2.75]; {_GRASP}"),
    gain_scatter=assumed(0.05, "1", "as for the BioTac; not measured on this sensor"),
    warm_up=measured(0.0, "count", f"none seen within a trial; {_GRASP}"),
    warm_up_tau=assumed(500.0, "s", "without effect while the warm-up is 0"),
    warm_up_scatter=assumed(0.0, "1", "without effect while the warm-up is 0"),
    wander=measured(0.2, "count", f"an upper bound; {_GRASP}"),
    wander_tau=assumed(60.0, "s", "not identifiable"),
    unit_gain=assumed(0.1, "1", "as for the BioTac; not measured on this sensor"),
    unit_rest_shared=measured(1.0, "count", f"fingers' medians 241-244; each taxel's own is `rest_spread`; {_GRASP}"),
    step=sourced(1.0, "count", "8-bit values on the bus; robotology/icub-firmware"),
    creep=(
        Creep(
            fraction=measured(0.15, "1", "tacman-fp7/tactile-control: at most 16 % [4, 29], motor and tendon included"),
            tau=measured(2.5, "s", "tacman-fp7/tactile-control: 2.5 s [0.8, 6.5]"),
        ),
    ),
)

RANGES = ranges(
    ("noise_scale", 0.85, 2.9, "1", "measured", f"0.30 at rest … 1.0 count under load, 0.35 here; {_GRASP}"),
    ("offset_scale", 0.0, 4.0, "1", "measured", f"0: each recording tared; {_GRASP}: 0.07-0.48, 0.2 here"),
    ("taxel_wander_count", 0.0, 0.2, "count", "measured", f"0.2 is an upper bound; {_GRASP}"),
    ("taxel_gain_scatter", 0.0, 0.1, "1", "assumed", "none … twice the value; not measured on this sensor"),
    ("taxel_creep_1_fraction", 0.04, 0.29, "1", "measured", "tacman-fp7/tactile-control: 16 % [4, 29]"),
    ("placement_x_mm", -1.8, 1.8, "mm", "assumed", "1.8: on taxel T4; the paper does not say where its caps touch"),
)
"""Plausible ranges of the fingertip's nuisances; factors refer to the nuisances' default values."""

# Force range, height, mass, supply power and availability: no source read so far states them.
DATA_SHEET = DataSheet(
    length=sourced(14.5, "mm", _SCHMITZ),
    width=sourced(13.0, "mm", _SCHMITZ),
    interface=Statement(
        text="AD7147 chip on I2C; on the robot by a board on CAN, 1 Mbit/s",
        source=Source(
            tag="sourced",
            reference="robotology/icub-firmware (chip, I2C), robotology/icub-main CanBusSkin (bit rate); Karl et al. "
            "2016 read the chip by I2C",
        ),
    ),
)

SPEC = SensorSpec(
    name="icub",
    title="iCub fingertip",
    principle="capacitive",
    principle_source=Source(tag="sourced", reference="Karl et al. 2016, table I"),
    streams=STREAMS,
    link_delay=derived(
        0.27,
        "ms",
        "robotology/icub-main CanBusSkin.cpp: 12 taxels are two frames of 8 bytes at 1 Mbit/s; 135 bits each with all "
        "stuff bits (CAN 2.0A: 44 + 64 bits, 24 stuffed, 3 between frames). On a bus that carries nothing else; a full "
        "board sends 32 frames, 4.3 ms",
    ),
    skin=SKIN,
    parameters=PARAMETERS,
    nuisances={"taxel": NUISANCES},
    ranges=RANGES,
    data_sheet=DATA_SHEET,
    references=(
        "Karl et al. 2016, ML-based tactile sensor calibration: A universal approach",
        "Schmitz et al. 2010 (fingertip, abstract)",
        "Jamali et al. 2015 (fingertip of fabric, abstract)",
        "robotology/icub-main, icub-firmware (frames, direction of the reading)",
    ),
)


TACTBENCH_API = 2


@hookimpl
def tactbench_sensors() -> list[SensorDescriptor]:
    """Return the descriptor of the iCub fingertip."""
    return [
        SensorDescriptor(
            spec=SPEC,
            transducer="tactbench.sensors.icub.transduction:build",
            driver="tactbench.sensors.icub.driver:FingertipDriver",
            emulator="tactbench.sensors.icub.emulator:build_emulator",
            emulated_link="can",
            log_reader="tactbench.sensors.icub.log:read_log",
        )
    ]

"""The BioTac as a declaration: streams, skin, what its transduction needs, nuisances."""

from __future__ import annotations

import math

from tactbench.plugin import (
    Dome,
    FluidBackedShell,
    Quantity,
    SensorSpec,
    SkinSheet,
    Source,
    assumed,
    derived,
    measured,
    sourced,
)
from tactbench.sensors.biotac.channels import MANUAL, STREAMS
from tactbench.sensors.biotac.likeness import LIKENESS
from tactbench.sensors.biotac.nuisances import HARD_HANDLED, NUISANCES
from tactbench.sensors.biotac.thermal import THERMAL

_MESH = "NVlabs/biotac_sim int_ext_skin_combined_ftw.tet and top_side_core_bc.obj"

SKIN = FluidBackedShell(
    sheet=SkinSheet(
        x_min=assumed(-14.5, "mm", "covers electrodes 1-19 with a margin; the core ends at -19.3 mm"),
        x_max=assumed(5.5, "mm", "covers electrode 7 on the shortened arc of the dome"),
        arc=derived(math.pi * 8.2, "mm", "half of the circumference at the outer radius"),
        dome=Dome(
            start=sourced(0.0, "mm", f"the core is a cylinder from -12 to 0 mm; {_MESH}"),
            arc_per_radian=derived(
                0.75 * 5.08, "mm", "the core's meridian, shortened as the places of its electrodes are"
            ),
        ),
        outer_radius=derived(8.2, "mm", f"{_MESH}: 8.08-8.31 mm at the pad"),
    ),
    young=assumed(0.8, "MPa", "silicone of the skin alone; 0.4-1.55 tried. Shore A 26 by the maker"),
    poisson=assumed(0.48, "1", "nearly incompressible silicone"),
    thickness=derived(1.6, "mm", f"{_MESH}: inner 6.47-6.69, outer 8.08-8.31 mm"),
    mid_radius=derived(7.4, "mm", "outer radius less half of the thickness"),
    tension=assumed(0.02, "N/mm", "no source"),
    contact_stiffness=assumed(1.299, "MPa/mm", "2 E / ((1 - nu^2) t); the factor 2 has no source"),
    core_stiffness=assumed(6.0, "MPa/mm", "penalty, stiff beside the skin"),
    gap=derived(1.27, "mm", f"{_MESH}: inner skin minus core 1.2-1.3 mm at the pad"),
    gap_side=derived(0.25, "mm", f"{_MESH}: 0.15-0.7 mm near 70 degrees, fitted by eye"),
    gap_side_fraction=derived(0.85, "1", f"{_MESH}: fitted by eye"),
    residual_film=assumed(0.06, "mm", "asperities of the inner skin keep a film open at touch-down"),
    clamp_stiffness=assumed(0.5, "MPa/mm", "soft clamp instead of the real seam and nail"),
    clamp_length=assumed(1.0, "mm", "soft clamp instead of the real seam and nail"),
)

_EXCITATION = (
    "shadow-robot/sr-visualization sr_gui_biotac biotac.py, map of 19 sensing and 4 excitation electrodes: its axial "
    "coordinate is 8.58 mm - x and its other 4.78 mm per radian, to the printed digit, for every electrode off the dome"
)

PARAMETERS: dict[str, Quantity] = {
    "contact_x": assumed(-5.0, "mm", "middle of the pad; the paper does not state where its caps touch"),
    "contact_s": assumed(0.0, "mm", "on the midline"),
    "core_radius": sourced(5.08, "mm", "radius on which the electrode table lies, e.g. sqrt(3.513^2 + 3.670^2)"),
    "film_radius": derived(5.965, "mm", f"half way between core 5.33 and inner skin 6.6 mm; {_MESH}"),
    "dome_shortening": assumed(0.75, "1", "meridian arc of the dome, shortened to keep electrode 7 on the sheet"),
    "conductivity": assumed(
        1.225, "S/m", "NaBr solution; the value at which the median electrode rests at 3237 counts, as measured"
    ),
    "reference_resistor": sourced(10e3, "ohm", f"10 kOhm; {MANUAL}"),
    "electrode_radius": assumed(0.6, "mm", "no source"),
    "excitation_radius": assumed(0.8, "mm", "no source"),
    "excitation_x_front": derived(-3.9, "mm", f"12.48 mm on the map; {_EXCITATION}"),
    "excitation_x_back": derived(-15.9, "mm", f"24.48 mm on the map; {_EXCITATION}"),
    "excitation_arc_front": derived(6.85, "mm", f"arc on the core, 6.45 mm on the map: 77 degrees; {_EXCITATION}"),
    "film_tail": assumed(
        10 / 3,
        "mm",
        "film behind the skin that can be pressed, up to the rear excitations: it stays as at rest",
    ),
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

SPEC = SensorSpec(
    name="biotac",
    title="SynTouch BioTac",
    principle="resistive",
    principle_source=Source(tag="sourced", reference="Karl et al. 2016, table I"),
    streams=STREAMS,
    skin=SKIN,
    parameters=PARAMETERS,
    nuisances=NUISANCES,
    scenarios={"hard-handled": HARD_HANDLED},
    likeness=LIKENESS,
    references=(
        "Karl et al. 2016, ML-based tactile sensor calibration: A universal approach",
        "Wettels, Santos, Johansson, Loeb 2008 (impedance of the electrodes)",
        "SynTouch BioTac SP product manual, 26 Oct 2015",
        "TAMS-Group/biotac_gazebo_plugin, clear-nus/biotac_driver (electrode table)",
        "NVlabs/biotac_sim (meshes of core and skin)",
        "shadow-robot/sr-visualization (map of the excitation electrodes)",
    ),
)

"""The door to simulation: what a sensor declares to be simulated, and what a simulated rig is made of.

Skins, nuisances, transducers and skin states; effects, checks of a simulation, and what its accuracy costs.
"""

from typing import TYPE_CHECKING

from tactbench.core.plugins.checks import Check, Verdict
from tactbench.core.plugins.cost import CostJob, CostPoint, CostStudy
from tactbench.core.plugins.interfaces import (
    EffectRun,
    EffectTrack,
    Explained,
    Reason,
    SimulatedPress,
    Transducer,
    TransducerFactory,
)
from tactbench.core.plugins.taking_part import effect_names, rig_context
from tactbench.core.samples import SkinGrid, SkinState
from tactbench.core.spec.figure import RealFigure
from tactbench.core.spec.rig import EffectDescriptor
from tactbench.core.spec.scene import Environment, Slide, Surface
from tactbench.core.spec.sensor import Creep, Nuisances, Scenario
from tactbench.core.spec.skin import BondedLayer, Dome, FluidBackedShell, FoamPad, SheetTable, Skin, SkinSheet
from tactbench.plugin.on_demand import on_demand

if TYPE_CHECKING:
    from tactbench.core.recording.reader import Recording, open_recording

__all__ = [
    "BondedLayer",
    "Check",
    "CostJob",
    "CostPoint",
    "CostStudy",
    "Creep",
    "Dome",
    "EffectDescriptor",
    "EffectRun",
    "EffectTrack",
    "Environment",
    "Explained",
    "FluidBackedShell",
    "FoamPad",
    "Nuisances",
    "RealFigure",
    "Reason",
    "Recording",
    "Scenario",
    "SheetTable",
    "SimulatedPress",
    "Skin",
    "SkinGrid",
    "SkinSheet",
    "SkinState",
    "Slide",
    "Surface",
    "Transducer",
    "TransducerFactory",
    "Verdict",
    "effect_names",
    "open_recording",
    "rig_context",
]

__getattr__ = on_demand(__name__)

"""Public interface for simulation: declarations of simulated sensors, and parts of simulated rigs.

Skins, nuisances, transducers and skin states; effects, comparisons with exact solutions, and computing times.
"""

from tactbench.core.plugins.interfaces import (
    CostJob,
    CostPoint,
    CostStudy,
    EffectRun,
    EffectTrack,
    Explained,
    Reason,
    SimulatedPress,
    Transducer,
    TransducerFactory,
    Verdict,
)
from tactbench.core.plugins.rigs import effect_names, rig_context
from tactbench.core.samples import SkinGrid, SkinState
from tactbench.core.spec.rig import EffectDescriptor
from tactbench.core.spec.scene import Environment, Slide, Surface
from tactbench.core.spec.sensor import Creep, Nuisances, Scenario, ranges
from tactbench.core.spec.skin import BondedLayer, Dome, FluidBackedShell, FoamPad, SheetTable, Skin, SkinSheet

__all__ = [
    "BondedLayer",
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
    "Reason",
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
    "ranges",
    "rig_context",
]

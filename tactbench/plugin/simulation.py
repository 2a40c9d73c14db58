"""Public interface for simulation: declarations of simulated sensors, and parts of simulated rigs.

Skins, nuisances, transducers and skin states; effects, comparisons with exact solutions, and computing times.
"""

from tactbench.core.on_demand import public_names
from tactbench.core.plugins.interfaces import (
    CostJob as CostJob,
    CostPoint as CostPoint,
    CostStudy as CostStudy,
    EffectRun as EffectRun,
    EffectTrack as EffectTrack,
    Explained as Explained,
    Reason as Reason,
    SimulatedPress as SimulatedPress,
    Transducer as Transducer,
    TransducerFactory as TransducerFactory,
    Verdict as Verdict,
)
from tactbench.core.plugins.rigs import effect_names as effect_names, rig_context as rig_context
from tactbench.core.samples import SkinGrid as SkinGrid, SkinState as SkinState
from tactbench.core.spec.rig import EffectDescriptor as EffectDescriptor
from tactbench.core.spec.scene import Environment as Environment, Slide as Slide, Surface as Surface
from tactbench.core.spec.sensor import Creep as Creep, Nuisances as Nuisances, Scenario as Scenario, ranges as ranges
from tactbench.core.spec.skin import (
    BondedLayer as BondedLayer,
    Dome as Dome,
    FluidBackedShell as FluidBackedShell,
    FoamPad as FoamPad,
    SheetTable as SheetTable,
    Skin as Skin,
    SkinSheet as SkinSheet,
)

__all__ = public_names(__name__)

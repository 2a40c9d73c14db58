"""An effect that every scene calls for, in a package that changes NumPy when it is imported."""

import numpy as np

from tactbench.plugin import hookimpl
from tactbench.plugin.simulation import EffectDescriptor, Reason

TACTBENCH_API = 2

np.round = np.floor


@hookimpl
def tactbench_effects():
    code = {"where": "patching_tactile:apply", "called_for": "patching_tactile:always"}
    return [EffectDescriptor(name="patching", title="Nothing", produces=("disturbance",), **code)]


def always(scene, sensor):
    return Reason(True, "every scene")


def apply(run):
    """Change nothing."""

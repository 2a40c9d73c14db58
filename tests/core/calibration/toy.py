"""A procedure over a toy: two hidden numbers, two readings of them, known in closed form."""

import math

from tactbench.core.calibration.draw import Draw, parameters_of
from tactbench.core.calibration.trial import Trial
from tactbench.core.spec.calibration import CalibrationSpec

SOURCE = {"tag": "assumed", "reference": "a test"}
TRUTH = {"width": 0.3, "height": 2.0}


def reading(parameters):
    """The toy's readings, strictly monotone in what they depend on."""
    return {
        "narrow": math.exp(-parameters["width"]),
        "tall": 3 * parameters["height"] + 0.1 * parameters["width"],
        "both": parameters["width"] * parameters["height"],
    }


def procedure(**more):
    """Two fitted numbers at the toy's truth, one held out, one finding."""
    outputs = [
        {"name": name, "title": name, "sensor": "icub", "task": "force", "estimator": {"name": "lasso"}}
        for name in ("narrow", "tall", "both")
    ]
    at = reading(TRUTH)
    stated = {"scale_reason": "a test", "source": SOURCE}
    return CalibrationSpec.model_validate({
        "title": "Toy", "seed": 5, "draws": 30, "rig": "twin", "protocol": "karl2016", "outputs": outputs,
        "nuisances": [
            {"name": "width", "sets": "placement_scatter_mm", "reason": "a test", "source": "assumed",
             "prior": {"kind": "uniform", "low": 0.0, "high": 1.0}},
            {"name": "height", "sets": "noise_scale", "reason": "a test", "source": "assumed",
             "prior": {"kind": "log-uniform", "low": 0.1, "high": 10.0}},
        ],
        "published": [
            {"output": "narrow", "value": at["narrow"], "scale": 0.1, "use": "fitted", **stated},
            {"output": "tall", "value": at["tall"], "scale": 1.0, "use": "fitted", **stated},
            {"output": "both", "value": at["both"], "scale": 0.1, "use": "held out", **stated},
        ],
        "tolerance": 1.0,
        "findings": [
            {"name": "taller", "statement": "tall exceeds both", "reason": "a test", "source": SOURCE,
             "all_of": [{"above": "tall", "below": "both", "margin": 3.0}]},
        ],
        **more,
    })  # fmt: skip


def work(trial: Trial):
    """Carry out a draw of the toy; draw 7 fails."""
    seed, values = parameters_of(trial.spec, trial.seed, trial.number)
    if trial.number == 7:
        return Draw(trial.number, seed, values, {}, "failed", "seven"), 0.5
    return Draw(trial.number, seed, values, reading(values)), 0.5


def draws(n, spec=None, seed=5):
    """The first n draws of the toy, none failing."""
    spec = spec or procedure()
    found = []
    for number in range(n):
        own, values = parameters_of(spec, seed, number)
        found.append(Draw(number, own, values, reading(values)))
    return found

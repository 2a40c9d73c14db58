"""Simulation of a motor under force control, whose control loop turns the commanded force into the true force."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tactbench.plugin import FloatArray
from tactbench.plugin.devices import LoopModel
from tactbench.rigs.twin.contact.load_table import LoadTable
from tactbench.rigs.twin.contact.stages import bare_skin
from tactbench.rigs.twin.synthesis import Load, Synthesis

BEYOND = 3.0
"""Multiple of the largest commanded force up to which the skin is solved; it limits the motor's travel."""
RETRACT_MM = 1.0
"""Largest travel [mm] of the motor away from the skin [assumed]; it bounds oscillations of the control loop."""
_CURVE_POINTS = 4001
"""Number of depths at which the force is tabulated; linear interpolation between them is off by less than 1e-4 of the
largest force (tested)."""


def apply(run: Synthesis) -> None:
    """Simulate the motor's force control over the recording, and use the resulting force as the load.

    Unless its rate is stated, the loop reads the force once per recorded sample, with the same noise as the recorded
    force: both come from one sensor.
    """
    drive = run.scene.drive
    if drive is None or not run.load.largest_n > 0:
        return
    duration = run.scene.profile.duration.to("s")
    per_sample = drive.rate is None
    step_s = duration / run.t_s.size if drive.rate is None else 1.0 / drive.rate.to("Hz")
    steps = run.t_s.size if per_sample else math.ceil(duration / step_s)
    t_s: FloatArray = np.arange(steps, dtype=np.float64) * step_s
    setpoint = run.load.at(t_s)
    errors = run.of_recording("force") if per_sample else run.of_recording("force", "loop")
    noise = run.scene.environment.force_noise.to("N") * errors.standard_normal(steps)
    table = bare_skin(run, BEYOND * run.load.largest_n)
    force_n, deepest = force_at_depth(table)
    start = float(table.skin(setpoint[:1]).depth_mm[0])
    model = LoopModel.of(drive, step_s, travel=(-RETRACT_MM, deepest))
    depths = model.simulate(force_n, setpoint, noise, start)
    forces = np.array([force_n(depth) for depth in depths.tolist()])
    run.follow(Load(t_s, forces))
    run.drawn["loop_steps_at_end"] = int(np.count_nonzero(depths >= deepest))


def force_at_depth(table: LoadTable) -> tuple[Callable[[float], float], float]:
    """Return the force as a function of depth, and the depth at which it ends: beyond, the force is constant.

    Depth rises with load, so that the curve of the load table can be inverted; at depths up to 0 the force is 0.
    """
    loads = np.linspace(0.0, float(table.loads_n[-1]), 20 * _CURVE_POINTS)
    # Ties and dips by rounding would leave a depth without its force.
    depths = np.maximum.accumulate(table.skin(loads).depth_mm)
    deepest = float(depths[-1])
    spacing = deepest / (_CURVE_POINTS - 1)
    forces: list[float] = np.interp(np.linspace(0.0, deepest, _CURVE_POINTS), depths, loads).tolist()
    forces[0] = 0.0

    def force_n(depth_mm: float) -> float:
        if depth_mm <= 0.0:
            return 0.0
        place = depth_mm / spacing
        before = int(place)
        if before >= _CURVE_POINTS - 1:
            return forces[-1]
        return forces[before] + (place - before) * (forces[before + 1] - forces[before])

    return force_n, deepest

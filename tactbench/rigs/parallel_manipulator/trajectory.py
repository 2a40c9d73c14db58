"""A straight move of the platform as joint targets at the controller's rate, tested and timed before it begins.

The inverse is taken for every sample: joints interpolated between distant places would leave the line. Where the joints
would exceed their own limits, near singular postures, the whole move is slowed in time and its line is kept: with time
stretched by f, joint speeds fall by f and joint accelerations by f^2, so f is the largest of 1, q'/q'_max and
sqrt(q''/q''_max) over the move. The profile stays the S-curve, its jerk falls by f^3. Slowing only where it is needed
would be quicker and would need a second profile without a limit of jerk; moves between presses have time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tactbench.plugin import UsageError
from tactbench.rigs.parallel_manipulator.geometry import Delta
from tactbench.rigs.parallel_manipulator.jacobian import joint_motion
from tactbench.rigs.parallel_manipulator.kinematics import inverse
from tactbench.rigs.parallel_manipulator.motion_profile import MotionLimits, MotionProfile
from tactbench.rigs.parallel_manipulator.workspace import Workspace

if TYPE_CHECKING:
    from tactbench.plugin import FloatArray

SAMPLES = 128
"""Times in each of the profile's seven pieces at which joint speeds and accelerations are computed for the stretch."""
RESERVE = 1.001
"""How much slower a move is than its samples ask for: between two of 128 samples of a smooth curve lies less
(`benchmarks/manipulator_oracles.py` looks elsewhere, at 1000 random moves)."""


@dataclass(frozen=True)
class Trajectory:
    """Joint targets of one move."""

    time_s: FloatArray
    """(n,) from 0, at the controller's rate; the last is at or after the end of the move."""
    p_m: FloatArray
    """(n, 3) places of the platform [m]."""
    q: FloatArray
    """(n, 3) joint targets, m or rad."""
    profile: MotionProfile

    @property
    def duration_s(self) -> float:
        """How long the move lasts [s]."""
        return self.profile.duration_s


def line_motion(
    delta: Delta, start_m: FloatArray, end_m: FloatArray, profile: MotionProfile, time_s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return places (n, 3) [m], joint values, speeds and accelerations (n, 3) at (n,) times of a straight move."""
    start, end = np.asarray(start_m, dtype=np.float64), np.asarray(end_m, dtype=np.float64)
    along = (end - start) / profile.distance_m if profile.distance_m > 0 else np.zeros(3)
    way, speed, acceleration = profile.at(time_s)
    p = start + way[:, None] * along
    if profile.distance_m > 0:
        p[way >= profile.distance_m] = end
    q = inverse(delta, p)
    rate, change = joint_motion(delta, p, q, speed[:, None] * along, acceleration[:, None] * along)
    return p, q, rate, change


def straight_move(
    workspace: Workspace, start_m: FloatArray, end_m: FloatArray, limits: MotionLimits, rate_hz: float
) -> Trajectory:
    """Return the joint targets of a straight move between two places (3,) [m].

    Raises
    ------
    PlaceRefusedError
        If any place of it is not permitted.
    UsageError
        If the rate is not a positive number.
    """
    if not 0 < rate_hz < math.inf:
        raise UsageError(f"Targets cannot be sent at {rate_hz} Hz.", hint="State the controller's rate.")
    workspace.check_move(start_m, end_m)
    delta = workspace.delta
    profile = MotionProfile.of(float(np.linalg.norm(np.subtract(end_m, start_m))), limits)
    times = np.interp(np.linspace(0, 7, 7 * SAMPLES + 1), np.arange(8), profile.corners_s)
    _, _, rate, change = line_motion(delta, start_m, end_m, profile, times)
    needed = max(
        float((np.abs(rate) / delta.joint_speed).max()),
        math.sqrt(float((np.abs(change) / delta.joint_acceleration).max())),
    )
    profile = replace(profile, stretch=max(1.0, RESERVE * needed))
    times = np.arange(math.ceil(profile.duration_s * rate_hz - 1e-9) + 1) / rate_hz
    p, q, _, _ = line_motion(delta, start_m, end_m, profile, times)
    return Trajectory(times, p, q, profile)

"""Slip labels (stick, incipient, gross slip) from displacement and forces of the reference, not from the sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tactbench.core.errors import DataError
from tactbench.core.samples import FloatArray, IntArray
from tactbench.core.spec.events import SlipThresholds, nanoseconds

UNDECIDED, STICK, INCIPIENT, GROSS = -1, 0, 1, 2
"""Slip states of a frame; a frame is undecided without contact, or if displacement and forces contradict each other."""


@dataclass(frozen=True)
class SlipLabels:
    """Slip labels of one recording, from its reference sensors."""

    state: IntArray
    """(n,) :data:`STICK`, :data:`INCIPIENT`, :data:`GROSS` or :data:`UNDECIDED` of each sample of the reference."""
    gross_ns: IntArray
    """(e, 2) onset and end [ns] of each gross slip that follows a hold in contact: the events."""


def stick_ratio(tangential_n: FloatArray, normal_n: FloatArray, friction: float) -> FloatArray:
    """Return (n,) c/a, the radius of the sticking area over that of the contact: ``(1 - |Q|/(mu P))^(1/3)``.

    Q is the tangential force [N], P the normal force [N], and mu the static coefficient of friction, known or
    measured on the reference.

    Notes
    -----
    Cattaneo 1938 and Mindlin 1949 (Johnson 1985, Contact Mechanics, eq. 7.39): two spheres, alike or incompressible,
    Q growing from zero at constant P. The result is zero if Q is mu P or more, and NaN without normal force. After
    unloading, or for other shapes, it measures the ratio of forces, not of radii.
    """
    share = np.full(normal_n.shape, np.nan)
    np.divide(np.abs(tangential_n), friction * normal_n, out=share, where=normal_n > 0)
    return np.asarray(np.cbrt(1.0 - np.minimum(share, 1.0)))


def slip_labels(
    t_ns: IntArray,
    displacement_m: FloatArray,
    tangential_n: FloatArray,
    normal_n: FloatArray,
    friction: float,
    thresholds: SlipThresholds,
) -> SlipLabels:
    """Label the samples of one recording's reference as stick, incipient or gross slip; docs/events.md defines these.

    Parameters
    ----------
    t_ns
        (n,) times of the reference, strictly rising [ns].
    displacement_m
        (n,) displacement of the surface relative to the skin, along the motion [m]. An encoder between surface and
        fixture also includes the displacement of a skin that moves along.
    tangential_n, normal_n, friction
        (n,) forces [N], and coefficient of friction; see :func:`stick_ratio`.
    thresholds
        Limits between the states.

    Notes
    -----
    Labels use later samples, unlike detectors: a hold is known when it is over. In contact, all samples outside a hold
    are gross slip, for any forces. A contact in a hold whose forces indicate gross slip is undecided: slip begins, or
    mu is too low. A slip at the start of the recording has no onset and is not an event, though its samples are gross.
    """
    if np.any(np.diff(t_ns) <= 0):
        raise DataError("Times of the reference do not rise strictly.", hint="Sort rows, or cut where the clock stops.")
    rest = at_rest(t_ns, displacement_m, thresholds)
    if not rest.any():
        raise DataError(
            f"The surface never rests within {thresholds.gross_displacement_m:g} m for {thresholds.hold_s:g} s.",
            hint="Slip is displacement after a hold: record such a hold, or set a shorter `hold_s` in the thresholds.",
        )
    contact = normal_n >= thresholds.contact_force_n
    ratio = np.where(contact, stick_ratio(tangential_n, normal_n, friction), np.nan)
    state = np.select(
        [~contact, ~rest, ratio <= thresholds.gross_stick_ratio, 1.0 - ratio > thresholds.incipient_slip_share],
        [UNDECIDED, GROSS, UNDECIDED, INCIPIENT],
        STICK,
    ).astype(np.int64)
    gross = _stretches(state == GROSS)
    held = np.concatenate([[False], (rest & contact)[:-1]])[gross[:, 0]]
    return SlipLabels(state, t_ns[gross[held]])


def at_rest(t_ns: IntArray, displacement_m: FloatArray, thresholds: SlipThresholds) -> npt.NDArray[np.bool_]:
    """Return an (n,) mask, True for samples within a hold of the surface.

    Notes
    -----
    A hold begins at a sample if no two displacements in the `hold_s` seconds from there differ by more than
    `gross_displacement_m`. It ends before the first later sample for which two displacements in the last `hold_s` do
    so: the onset, even if another hold begins there, as after a slip that is shorter than a sample.
    """
    n, hold = t_ns.size, nanoseconds(thresholds.hold_s)
    rest = np.zeros(n, dtype=np.bool_)
    last, first = np.searchsorted(t_ns, t_ns + hold, side="left"), np.searchsorted(t_ns, t_ns - hold, side="right") - 1
    ahead, behind = last < n, first >= 0  # where there is so much time
    place = np.arange(n)
    still = place[ahead][spread(displacement_m, place[ahead], last[ahead] + 1) <= thresholds.gross_displacement_m]
    moved = place[behind][spread(displacement_m, first[behind], place[behind] + 1) > thresholds.gross_displacement_m]
    onset = -1
    while (following := np.searchsorted(still, onset)) < still.size:
        begin = still[following]
        later = np.searchsorted(moved, last[begin], side="right")
        end = moved[later] if later < moved.size else n
        rest[max(begin, onset + 1) : end] = True
        onset = end
    return rest


def spread(values: FloatArray, first: IntArray, end: IntArray) -> FloatArray:
    """Return the (k, …) ranges, largest minus smallest value, of each ``values[first:end]``; 0 for an empty slice."""
    least, largest = extremes(values, first, end)
    return np.asarray(largest - least)


def extremes(values: FloatArray, first: IntArray, end: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the (k, …) smallest and largest of each ``values[first:end]``; the value at `first` for an empty slice."""
    pairs = np.column_stack([first, end]).ravel()
    padded = np.concatenate([values, values[-1:]])  # reduceat wants every place to exist
    return np.minimum.reduceat(padded, pairs)[::2], np.maximum.reduceat(padded, pairs)[::2]


def _stretches(mask: npt.NDArray[np.bool_]) -> IntArray:
    """Return the (k, 2) indices of the first and last element of each run of True in a mask."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int64))
    return np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1])

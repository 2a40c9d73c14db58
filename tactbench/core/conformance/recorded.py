"""Checks of a recording of a sensor; no code of the plugin runs."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import (
    Recorded,
    good,
    pressing_force,
    rate_is_right,
    read_back,
    within_limits,
)

LARGEST_N = 1000.0
"""No fingertip is pressed with more; a press of 10 N in gram-force reads 1020."""
CLEAR = 0.5
"""Correlation of a taxel with the force from which on its sign can be told."""


@lru_cache(maxsize=2)
def _read(subject: Subject) -> Recorded:
    if subject.recording is None:
        skip("no recording is given: `--recording FILE` reads one")
    with code_of(str(subject.recording), subject):
        return read_back(subject.recording)


@check("sensor", mode="recording")
def recording_fits_the_spec(subject: Subject) -> None:
    """A real unit shows another rate, range, sign or force than is stated where the spec or the decoding is wrong.

    Give a healthy recording of this sensor (`tactbench inspect FILE`). Correct rate_hz, lower, upper and sign of the
    spec, the type and byte order of the decoding, how the device is set up, or the force's unit in the mapping (1 gf is
    0.00981 N).
    """
    meta, data, wrong = _read(subject)
    spec = subject.registry.sensors[subject.name].spec
    if meta.sensor.name != spec.name:
        fail("meta.sensor.name", f"it is of {meta.sensor.name!r}")
    strange = {one.name for one in meta.sensor.channels()} - {one.name for one in spec.channels()}
    if strange:
        fail("meta.sensor.streams", f"the sensor has no channel {min(strange)}")
    if wrong:
        fail("file", wrong)
    pressing = None
    if any(channel.kind == "force" for one in meta.reference if one.name in data for channel in one.channels):
        pressing, force_n = pressing_force(data, meta.reference)
        if np.nanmax(np.abs(force_n)) > LARGEST_N:
            fail("reference", f"it reaches {np.nanmax(np.abs(force_n)):.4g} N: are these gram-force?")
    for stated in spec.streams:
        if stated.name not in data:
            continue
        stream, limits = data[stated.name], {one.name: one for one in stated.channels}
        own_rate = stated.name in meta.own_rates_hz or (meta.simulated and meta.emulation is None)
        rate_is_right(f"spec.streams[{stated.name}]", stream, None if own_rate else stated.rate_hz)
        for column, channel in enumerate(stream.spec.channels):
            sign, values = limits[channel.name].sign, good(stream)[:, column]
            where = f"spec.streams[{stated.name}].channels[{channel.name}]"
            within_limits(where, limits[channel.name], values)
            if channel.kind != "taxel" or stream.t_ns is None or pressing is None or pressing.t_ns is None:
                continue
            felt = np.interp(stream.t_ns, pressing.t_ns, force_n)
            there = np.isfinite(values) & np.isfinite(felt)
            if there.any() and np.ptp(values[there]) > 0 and np.ptp(felt[there]) > 0:
                likeness = float(np.corrcoef(values[there], felt[there])[0, 1])
                if likeness * sign < -CLEAR:
                    fail(f"{where}.sign", f"{sign:+d} is stated, its correlation with the force is {likeness:+.2f}")


@check("sensor", mode="recording", needs="recording-fits-the-spec")
def recording_is_of_a_real_unit(subject: Subject) -> None:
    """Only a real unit shows what a sensor is; a simulation shows what somebody believes it to be.

    Record a real unit, or import recordings of one.
    """
    if _read(subject).meta.simulated:
        skip("it is simulated, or its devices are emulated")

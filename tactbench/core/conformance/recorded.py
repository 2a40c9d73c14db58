"""Checks of a recording of a sensor; no code of the plugin runs."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.streams import (
    Recorded,
    good,
    limits_of,
    pressing_force,
    rate_is_right,
    read_back,
    within_limits,
)
from tactbench.core.samples import StreamData
from tactbench.core.spec.recording import RecordingMeta
from tactbench.core.spec.sensor import SensorSpec

LARGEST_N, MOST_N = 1000.0, 100.0  # at most, and in the median: a press of 10 N in gram-force reads 1020
LOADED = 0.2  # share of the largest force
FAR, FAR_IN_RANGE = 1.0, 0.25  # spans of readings, and shares of the range, by which a stated rest may lie off them
CLEAR = 0.5  # correlation of a taxel with the force from which on its sign can be told


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
    fits(meta, data, spec)


def fits(meta: RecordingMeta, data: Mapping[str, StreamData], spec: SensorSpec) -> None:
    """Fail where a recording shows forces beyond a finger's, or another rate, range, rest or sign than `spec`."""
    pressing = None
    known = [one for each in meta.reference if each.name in data for one in each.channels]
    if any(one.kind == "force" and one.name in ("fz", "normal") for one in known):
        pressing, force_n = pressing_force(data, meta.reference)
        size_n = np.abs(force_n[np.isfinite(force_n)])
        loaded = size_n[size_n > LOADED * size_n.max(initial=0.0)]
        if len(loaded) and (size_n.max() > LARGEST_N or np.median(loaded) > MOST_N):
            text = f"{np.median(loaded):.4g} N (median while loaded), {size_n.max():.4g} N at most"
            fail("reference", f"{text}: are these gram-force?")
    for stated in spec.streams:
        if stated.name not in data:
            continue
        stream, limits = data[stated.name], {one.name: one for one in stated.channels}
        own_rate = stated.name in meta.own_rates_hz or (meta.simulated and meta.emulation is None)
        rate_is_right(f"spec.streams[{stated.name}]", stream, None if own_rate else stated.rate_hz)
        for column, channel in enumerate(stream.spec.channels):
            own, values = limits[channel.name], good(stream)[:, column]
            where = f"spec.streams[{stated.name}].channels[{channel.name}]"
            within_limits(where, own, values)
            there = values[np.isfinite(values)]
            if own.rest is not None and len(there):
                rest, low, high = own.rest.to(own.unit), there.min(), there.max()
                apart = max(low - rest, rest - high)
                ends = [one for one in limits_of(own) if np.isfinite(one)]
                if apart > max(FAR * (high - low), FAR_IN_RANGE * (np.ptp(ends) if ends else 0.0)):
                    fail(f"{where}.rest", f"{rest:g} is stated, and it reads {low:g} to {high:g}")
            if channel.kind != "taxel" or stream.t_ns is None or pressing is None or pressing.t_ns is None:
                continue
            felt = np.interp(stream.t_ns, pressing.t_ns, force_n)
            whole = np.isfinite(values) & np.isfinite(felt)
            if whole.any() and np.ptp(values[whole]) > 0 and np.ptp(felt[whole]) > 0:
                likeness = float(np.corrcoef(values[whole], felt[whole])[0, 1])
                if likeness * own.sign < -CLEAR:
                    fail(f"{where}.sign", f"{own.sign:+d} is stated, its correlation with the force is {likeness:+.2f}")


@check("sensor", mode="recording", needs="recording-fits-the-spec")
def recording_is_of_a_real_unit(subject: Subject) -> None:
    """Only a real unit shows what a sensor is; a simulation shows what somebody believes it to be.

    Record a real unit, or import recordings of one.
    """
    if _read(subject).meta.simulated:
        skip("it is simulated, or its devices are emulated")

"""Checks of what is real: a recording of a sensor, and the devices that a rig file names, which are read or press.

Of the plugin of a recording no code runs. Where a line is opened, checks run in the process of the command, so that
Ctrl-C reaches the rig, and without a limit of time.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache, partial
from typing import Any

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.driver import look_at, opened_on
from tactbench.core.conformance.press import WHY, slow_ramp, tiny_scene
from tactbench.core.conformance.streams import (
    FORCE_SHARE,
    Recorded,
    carried_out,
    force_is,
    good,
    joined,
    pressing_force,
    rate_is_right,
    read_back,
    within_limits,
)
from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.rig_files import load_rig_file
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.samples import FloatArray, StreamData
from tactbench.core.spec.rig import SensorDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.sensor import Nuisances

LARGEST_N = 1000.0
"""No fingertip is pressed with more; a press of 10 N in gram-force reads 1020."""
CLEAR = 0.5
"""Correlation of a taxel with the force from which on its sign can be told."""
FORCE_N = 1.0
"""At the end of a press: a motor with friction still follows it, and no fingertip is harmed."""
SECONDS, HOLD_S = 8.0, 1.0
"""A motor that lifts off for the unloaded hold takes some of them to be back on the skin."""
END, PEAK = 16, 99
"""The force at the end is the mean of the last sixteenth of its rows, the largest their 99th percentile: of 8 s those
are half a second, and what is longer than a tenth: noise is no overshoot."""
LARGEST = 1.5
"""Times `FORCE_N`, which the force may not exceed (assumed: a loop that overshoots by half is badly tuned)."""
NOISY = 3.0
"""By which factor a real unit's noise may differ from the stated one (assumed: units and rooms differ by two)."""


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


def _file(subject: Subject) -> RigFile:
    if subject.rig_file is None:
        skip("no rig file is given: `--rig-file FILE` says which devices it has")
    return load_rig_file(subject.rig_file, subject.registry)


@check("sensor", "device", mode="invasive", needs="code-names-resolve")
def real_device_answers(subject: Subject) -> None:
    """The emulator is what the author believes the device to be; only the device knows its rate and its noise at rest.

    Let nothing touch it. Look at `tactbench doctor --rig-file FILE` for ports, permissions and what the device says.
    """
    from tactbench.devices.rig_devices import options_of
    from tactbench.links.address import open_link

    descriptor, file = subject.descriptor, _file(subject)
    if descriptor.driver is None:
        skip("it names no driver")
    named = {getattr(one, "device", name): one for name, one in file.entries().items()}
    if subject.name not in named:
        fail(str(subject.rig_file), f"it has no entry for {subject.name}")
    entry = named[subject.name]
    if entry.emulated:
        skip("the rig file says that the device is emulated")
    opened = opened_on(subject, partial(open_link, entry.link), options_of(descriptor, entry), time.monotonic_ns)
    try:
        with code_of("driver.identify", subject):
            opened.driver.identify()
        for stream in look_at(opened).values():
            _noise_is_as_stated(subject, stream)
    finally:
        with suppress(TactbenchError):
            opened.driver.close()


def _noise_is_as_stated(subject: Subject, stream: StreamData) -> None:
    """Fail where a channel stands still that has noise, or has much more or less of it than its spec states."""
    for column, channel in enumerate(stream.spec.channels):
        where, sd = f"driver.read: {stream.spec.name}.{channel.name}", float(np.nanstd(good(stream)[:, column]))
        stated = getattr(subject.spec, "nuisances", {}).get(channel.kind, Nuisances())
        hidden, seen = stated.hidden(), channel.kind == "force" or stated.white.value > stated.step.value / 2
        if (seen and sd <= hidden / NOISY) or (hidden and sd > NOISY * hidden):
            text = f"its noise at rest is {sd:.3g} {channel.unit} (sd), {hidden:.3g} are stated in spec.nuisances"
            fail(where, text if sd else f"it is constant at rest: is it connected? {hidden:.3g} (sd) are stated")


def _zeros(drawn: Mapping[str, Any]) -> list[float]:
    """Return what was taken off the reference's channels as their zero, as PressingForce.about says it."""
    texts = [str(text) for name, text in sorted(drawn.items()) if name.startswith("zero of ")]
    return [float(one) for text in texts for one in text.split(",")]


def _built(subject: Subject) -> tuple[Any, SensorDescriptor, Any]:
    """Return the rig, the first sensor of its file, and a slow press."""
    file = _file(subject)
    if file.rig != subject.name:
        skip(f"the rig file is for the rig {file.rig}")
    context = rig_context(subject.registry, rig_file=file, operator=subject.operator)
    scene = tiny_scene(profile=slow_ramp(FORCE_N, SECONDS, HOLD_S))
    return subject.code("where")(context), subject.registry.sensors[next(iter(file.sensors))], scene


@check("rig", mode="invasive", needs="code-names-resolve")
def real_rig_presses(subject: Subject) -> None:
    """Estimators are taught the recorded force: it must not come late, with another sign or too far, nor stay.

    Look at `tactbench doctor --rig-file FILE` for limits, at the sign and unit of the force sensor in the rig file,
    then at the gains of the force loop. Retreat at the end of each scene, also of one that failed; let `stop` retreat,
    wait for its end, and return "" or what is to be done by hand.
    """
    first: list[Any] = []
    with code_of("where", subject):
        rig, sensor, scene = _built(subject)
        made = carried_out(rig, sensor, subject.descriptor, scene, rig_file=_file(subject), opened=first.append)
    if not hasattr(first[0], "stop"):
        return  # nothing in it moves by itself: a hand presses
    _, force_n = pressing_force(made.came, made.meta.reference)
    force_is("reference", float(force_n[-max(1, len(force_n) // END) :].mean()), FORCE_N)
    largest = float(np.percentile(force_n, PEAK))
    if largest > LARGEST * FORCE_N:
        fail("reference", f"the force rises to {largest:.3g} N in a press to {FORCE_N:g} N")
    with code_of("where", subject), rig.open(sensor, scene, seed=2) as acquisition:
        every = (*acquisition.streams, *acquisition.reference)

        def force(*blocks: Any) -> FloatArray:
            return pressing_force(joined("open", every, blocks), acquisition.reference)[1]

        came, rising = iter(acquisition), []
        try:
            for block in came:
                rising.append(block)
                if np.abs(force(block)).max(initial=0.0) > FORCE_N / 2:
                    break
        except KeyboardInterrupt:
            acquisition.stop("stopped by hand")
            raise
        message = acquisition.stop(WHY)
        left = force(*came)[-5:]
    # The hold is the first fifth of the way to half of the force, or more.
    held = force(*rising)
    off = np.subtract(_zeros(acquisition.drawn), _zeros(made.meta.drawn))
    off_n = max([held[: max(1, len(held) // 5)].mean(), *off], key=abs)
    if abs(off_n) > FORCE_SHARE * FORCE_N:
        fail("open", f"the force or its zero is {off_n:.3g} N off when the next press begins, before anything touches")
    if message or (len(left) and abs(left.mean()) > FORCE_SHARE * FORCE_N):
        fail("stop", message or f"{left.mean():.3g} N are left after it has returned")

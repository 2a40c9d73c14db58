"""Checks that open a line or press: with the devices that a rig file names.

They run in the process of the command, so that Ctrl-C reaches the rig, and without a limit of time.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.driver import Line, Opened, look_at
from tactbench.core.conformance.press import FORCE_SHARE, WHY, force_is, pressing_channel, tiny_scene
from tactbench.core.errors import RigError, TactbenchError
from tactbench.core.plugins.emulators import running
from tactbench.core.plugins.rig_files import load_rig_file
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig import DeviceDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import RigFile

FORCE_N = 1.0
"""At the end of a press: a motor with friction still follows it, and no fingertip is harmed."""
SECONDS, HOLD_S = 8.0, 1.0
"""A motor that lifts off for the unloaded hold takes some of them to be back on the skin."""
END_S, PEAK_S = 0.5, 0.1
"""Over which the force at the end, and the largest force are averaged: noise is no overshoot."""
LARGEST = 1.5
"""Times `FORCE_N`, which the force may not exceed (assumed: a loop that overshoots by half is badly tuned)."""


def _file(subject: Subject) -> RigFile:
    if subject.rig_file is None:
        skip("no rig file is given: `--rig-file FILE` says which devices it has")
    return load_rig_file(subject.rig_file, subject.registry)


@check("sensor", "device", mode="invasive", needs=("code-names-resolve",), carries_out=True)
def real_device_answers(subject: Subject) -> None:
    """The emulator is what the author believes the device to be; only the device knows.

    Look at `tactbench doctor --rig-file FILE` for ports, permissions and what the device says.
    """
    from tactbench.core.plugins.rig_devices import options_of
    from tactbench.devices.driver import DriverSettings
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
    line = Line(partial(open_link, entry.link))
    streams = () if isinstance(descriptor, DeviceDescriptor) else descriptor.spec.streams
    with code_of("driver", subject):
        driver = subject.code("driver")(DriverSettings(line, streams, options_of(descriptor, entry)))
    try:
        with code_of("driver.identify", subject):
            driver.identify()
        look_at(Opened(subject, time.monotonic_ns, lambda until_ns: None, line, driver))
    finally:
        with suppress(TactbenchError):
            driver.close()
    if line.still_open:
        fail("driver.close", "its link is still open afterwards")


class _Kept:
    """A rig that keeps its last acquisition, to be asked after its end."""

    def __init__(self, rig: Any) -> None:
        self._rig = rig
        self.last: Any = None

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Any, *, seed: int) -> Iterator[Any]:
        with self._rig.open(sensor, scene, seed=seed) as self.last:
            yield self.last


def _built(subject: Subject) -> tuple[_Kept, SensorDescriptor, Any]:
    """Return the rig, the first sensor of its file, and a slow press."""
    file = _file(subject)
    if file.rig != subject.name:
        skip(f"the rig file is for the rig {file.rig}")
    ramp = ForceRamp(
        end=assumed(FORCE_N, "N", WHY), hold=assumed(HOLD_S, "s", WHY), duration=assumed(SECONDS, "s", WHY), samples=100
    )
    context = rig_context(subject.registry, rig_file=running(file), operator=subject.operator)
    rig = _Kept(subject.code("where")(context))
    return rig, subject.registry.sensors[next(iter(file.sensors))], tiny_scene("check", profile=ramp)


def _zero_n(acquisition: Any) -> float:
    """Return what was taken off the pressing force as its zero [N], as PressingForce.about says it; 0: nothing."""
    found = pressing_channel(tuple(acquisition.reference))
    about = "" if found is None else acquisition.drawn.get(f"zero of {found[0].name}", "")
    return float(str(about).split(",")[found[1]]) if found is not None and about else 0.0


@lru_cache(maxsize=1)
def _first_zero_n(subject: Subject) -> float | None:
    """Press once, recorded as `tactbench record` does it; return the zero [N], or None: nothing moves by itself."""
    import numpy as np

    from tactbench.core.acquisition import acquire
    from tactbench.core.recording.health import examine
    from tactbench.core.recording.reader import open_recording

    with TemporaryDirectory() as folder, code_of("where", subject):
        rig, sensor, scene = _built(subject)
        path = Path(folder) / "check.h5"
        made = acquire(
            rig, sensor, subject.descriptor, scene, role=None, seed=1, path=path,
            clock=time.perf_counter, provenance={}, rig_file=_file(subject),
        )  # fmt: skip
        if made.meta.excluded:
            raise RigError(f"Its recording is {made.meta.excluded}.")
        with open_recording(path) as recording:
            wrong = [f"streams[{one.stream}]: {one.message}" for one in examine(recording) if one.severity == "error"]
            read = {name: recording.read(name) for name in recording.stream_names}
    if wrong:
        fail("recording", f"it is not healthy: {'; '.join(wrong)}")
    for name, one in read.items():
        if not len(one.data):
            fail(f"streams[{name}]", "the press gave no sample of it")
    if not hasattr(rig.last, "stop"):
        return None
    found = pressing_channel(tuple(rig.last.reference))
    if found is None:
        fail("reference", "it has no channel of kind force called fz or normal")
    stream = read[found[0].name]
    assert stream.t_ns is not None
    t_s, force_n = (stream.t_ns - stream.t_ns[0]) * 1e-9, stream.data[:, found[1]].astype(np.float64)
    force_is("reference", float(force_n[t_s > t_s[-1] - END_S].mean()), FORCE_N)
    width = max(1, round(PEAK_S * len(t_s) / max(float(t_s[-1]), PEAK_S)))
    largest = float(np.convolve(force_n, np.ones(width) / width, "valid").max())
    if largest > LARGEST * FORCE_N:
        fail("reference", f"the force rises to {largest:.3g} N in a press to {FORCE_N:g} N")
    return _zero_n(rig.last)


@check("rig", mode="invasive", needs=("code-names-resolve",), carries_out=True)
def real_rig_presses(subject: Subject) -> None:
    """Estimators are taught the recorded force: a rig that presses late, with another sign or too far misleads them.

    Look at `tactbench doctor --rig-file FILE` for limits, at the sign and unit of the force sensor in the rig file,
    then at the gains of the force loop.
    """
    _first_zero_n(subject)


@check("rig", mode="invasive", needs=("real-rig-presses",))
def real_rig_lets_go(subject: Subject) -> None:
    """A rig that still presses when the next press begins takes that load for zero; Ctrl-C must take the load off.

    Retreat at the end of each scene, also of one that failed; let `stop` retreat, wait for its end, and return "" or
    what is to be done by hand.
    """
    import numpy as np

    first_n = _first_zero_n(subject)
    if first_n is None:
        skip("nothing in it moves by itself: a hand presses")
    rows: list[tuple[float, float]] = []

    def take(block: Any) -> None:
        if block.stream == stream.name:
            rows.extend(zip((1e-9 * block.t_ns).tolist(), block.data[:, column].tolist(), strict=True))

    with code_of("where", subject):
        rig, sensor, scene = _built(subject)
        with rig.open(sensor, scene, seed=2) as acquisition:
            stream, column = pressing_channel(tuple(acquisition.reference)) or fail("reference", "it has no fz now")
            blocks = iter(acquisition)
            try:
                for block in blocks:
                    take(block)
                    if rows and abs(np.mean([force for _, force in rows[-5:]])) > FORCE_N / 2:
                        break
            except KeyboardInterrupt:
                acquisition.stop("stopped by hand")
                raise
            pressed = len(rows)
            message = acquisition.stop(WHY)
            for block in blocks:
                take(block)
    hold = float(np.mean([force for t_s, force in rows if t_s - rows[0][0] < HOLD_S])) if rows else 0.0
    for what, force in (("force", hold), ("zero", _zero_n(acquisition) - first_n)):
        if abs(force) > FORCE_SHARE * FORCE_N:
            fail("open", f"the {what} is {force:.3g} N off when the next press begins, before anything touches")
    left = [force for _, force in rows[pressed:]][-5:]
    if message or (left and abs(np.mean(left)) > FORCE_SHARE * FORCE_N):
        fail("stop", message or f"{np.mean(left):.3g} N are left after it has returned")

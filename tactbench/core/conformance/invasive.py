"""Checks that open a line or press: with the devices that a rig file names.

They run in the process of the command, so that Ctrl-C reaches the rig, and without a limit of time.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import check, code_of, fail, skip
from tactbench.core.conformance.driver import Lines, look_at
from tactbench.core.conformance.press import FORCE_SHARE, pressing_channel
from tactbench.core.conformance.subject import Subject
from tactbench.core.conformance.trial_press import tiny_scene
from tactbench.core.errors import RigError, TactbenchError
from tactbench.core.plugins.emulators import running
from tactbench.core.plugins.rig_files import load_rig_file
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig import SensorDescriptor
from tactbench.core.spec.scene import Scene
from tactbench.core.spec.sensor import StreamSpec

if TYPE_CHECKING:
    from tactbench.core.samples import FloatArray
    from tactbench.core.spec.rig_file import RigFile

FORCE_N = 1.0
"""At the end of a press: a motor with friction still follows it, and no fingertip is harmed."""
SECONDS = 8.0
"""A motor that lifts off for the unloaded hold takes some of them to be back on the skin."""
HOLD_S = 1.0
END_S = 0.5
"""Over which the force at the end is averaged; the ramp gives 0.04 N less then."""
PEAK_S = 0.1
"""Over which the largest force is averaged: noise is no overshoot."""
LARGEST = 1.5
"""Times `FORCE_N`, which the force may not exceed (assumed: a loop that overshoots by half is badly tuned)."""


@check("sensor", "device", mode="invasive", level="silver", needs=("code-names-resolve",), may_skip=True)
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
    if isinstance(descriptor, SensorDescriptor):
        entries = [file.sensors[subject.name]] if subject.name in file.sensors else []
        streams = descriptor.spec.streams
    else:
        entries = [one for one in file.entries().values() if getattr(one, "device", None) == subject.name]
        streams = ()
    if not entries:
        fail(str(subject.rig_file), f"it has no entry for {subject.name}")
    entry = entries[0]
    if entry.emulated:
        skip("the rig file says that the device is emulated")
    lines = Lines(partial(open_link, entry.link))
    with code_of("driver", subject.package):
        options = options_of(descriptor, entry)
        driver = subject.code("driver")(DriverSettings(lines, streams, options))
    try:
        with code_of("driver.identify", subject.package):
            driver.identify()
        look_at(subject, driver, time.monotonic_ns)
    finally:
        with suppress(TactbenchError):
            driver.close()
    if lines.still_open:
        fail("driver.close", "its link is still open afterwards")


def _file(subject: Subject) -> RigFile:
    if subject.rig_file is None:
        skip("no rig file is given: `--rig-file FILE` says which devices it has")
    return load_rig_file(subject.rig_file, subject.registry)


def real_scene() -> Scene:
    """Return a slow press: a ramp to `FORCE_N` within `SECONDS`, after `HOLD_S` without load."""
    why = "a check of plugins"
    ramp = ForceRamp(
        end=assumed(FORCE_N, "N", why), hold=assumed(HOLD_S, "s", why), duration=assumed(SECONDS, "s", why),
        samples=100,
    )  # fmt: skip
    return tiny_scene("check", profile=ramp)


class _Kept:
    """A rig that keeps its last acquisition, to be asked after its end."""

    def __init__(self, rig: Any) -> None:
        self._rig = rig
        self.last: Any = None

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[Any]:
        with self._rig.open(sensor, scene, seed=seed) as self.last:
            yield self.last


def _built(subject: Subject) -> tuple[_Kept, SensorDescriptor]:
    """Return the rig and the first sensor of its file."""
    file = _file(subject)
    if file.rig != subject.name:
        skip(f"the rig file is for the rig {file.rig}")
    sensor = subject.registry.sensors[next(iter(file.sensors))]
    context = rig_context(subject.registry, rig_file=running(file), operator=subject.operator)
    with code_of("where", subject.package):
        return _Kept(subject.code("where")(context)), sensor


@dataclass(frozen=True)
class RealPress:
    """What came of a press that was carried out to its end."""

    reference: tuple[StreamSpec, ...]
    rows: dict[str, FloatArray]
    """By stream: (n, channels)."""
    t_s: dict[str, FloatArray]
    """By stream: (n,) seconds since the first row."""
    zero_n: float
    moves: bool
    """Whether it can be stopped: something moves by itself. Otherwise a hand presses."""
    wrong: str
    """What is wrong with its recording; empty: nothing."""

    def force_n(self) -> tuple[FloatArray, FloatArray]:
        """Return seconds and pressing force [N]; skips where nothing moves by itself."""
        if not self.moves:
            skip("nothing in it moves by itself: a hand presses")
        found = pressing_channel(self.reference)
        if found is None:
            fail("reference", "it has no channel of kind force called fz or normal")
        stream, column = found
        return self.t_s[stream.name], self.rows[stream.name][:, column]


@lru_cache(maxsize=1)
def _pressed(subject: Subject) -> RealPress:
    """Return the first press, recorded as `tactbench record` does it."""
    import numpy as np

    from tactbench.core.acquisition import acquire
    from tactbench.core.recording.health import examine
    from tactbench.core.recording.reader import open_recording

    rig, sensor = _built(subject)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "check.h5"
        with code_of("where", subject.package):
            made = acquire(
                rig, sensor, subject.descriptor, real_scene(), role=None, seed=1, path=path,
                clock=time.perf_counter, provenance={}, rig_file=_file(subject),
            )  # fmt: skip
            if made.meta.excluded:
                raise RigError(f"Its recording is {made.meta.excluded}.")
        with open_recording(path) as recording:
            wrong = [f"streams[{one.stream}]: {one.message}" for one in examine(recording) if one.severity == "error"]
            read = {name: recording.read(name) for name in recording.stream_names}
    return RealPress(
        reference=tuple(rig.last.reference),
        rows={name: one.data.astype(np.float64) for name, one in read.items()},
        t_s={name: (one.t_ns - one.t_ns[:1]) * np.float64(1e-9) for name, one in read.items() if one.t_ns is not None},
        zero_n=_zero_n(rig.last),
        moves=hasattr(rig.last, "stop"),
        wrong="; ".join(wrong),
    )  # fmt: skip


def _zero_n(acquisition: Any) -> float:
    """Return what was taken off the pressing force as its zero [N], as PressingForce.about says it; 0: nothing."""
    found = pressing_channel(tuple(acquisition.reference))
    said = "" if found is None else acquisition.drawn.get(f"zero of {found[0].name}", "")
    return float(str(said).split(",")[found[1]]) if found is not None and said else 0.0


@check("rig", mode="invasive", level="silver", needs=("code-names-resolve",), may_skip=True)
def real_rig_presses(subject: Subject) -> None:
    """A rig of real devices shows only by a press whether it gives what tasks need.

    Look at `tactbench doctor --rig-file FILE --seconds 0` for limits, and at the message for what is missing.
    """
    made = _pressed(subject)
    for name, rows in made.rows.items():
        if not len(rows):
            fail(f"streams[{name}]", "the press gave no sample of it")
    if made.wrong:
        fail("recording", f"it is not healthy: {made.wrong}")


@check("rig", mode="invasive", level="silver", needs=("real-rig-presses",))
def real_rig_follows_the_profile(subject: Subject) -> None:
    """Estimators are taught the recorded force: a rig that presses late, not at all or with another sign misleads them.

    Look at the sign and unit of the force sensor in the rig file, then at the force loop's gains.
    """
    t_s, force_n = _pressed(subject).force_n()
    found = float(force_n[t_s > t_s[-1] - END_S].mean())
    if abs(found - FORCE_N) > FORCE_SHARE * FORCE_N:
        turned = ": is its sign turned?" if found < 0 else ""
        fail("reference", f"the force is {found:.3g} N at the end of a press to {FORCE_N:g} N{turned}")


@check("rig", mode="invasive", level="silver", needs=("real-rig-presses",))
def real_rig_does_not_overshoot(subject: Subject) -> None:
    """A press beyond what was asked for harms a sensor, and nobody sees it in the score.

    Lower the gains of the force loop, or the speed at which the surface is touched.
    """
    import numpy as np

    t_s, force_n = _pressed(subject).force_n()
    width = max(1, round(PEAK_S * len(t_s) / max(float(t_s[-1]), PEAK_S)))
    largest = float(np.convolve(force_n, np.ones(width) / width, "valid").max())
    if largest > LARGEST * FORCE_N:
        fail("reference", f"the force rises to {largest:.3g} N in a press to {FORCE_N:g} N")


@dataclass(frozen=True)
class StoppedPress:
    """What came of a press that was stopped in its midst."""

    zero_n: float
    unloaded_n: float
    """Mean force of its unloaded hold."""
    left_n: float | None
    """The last force after it was stopped; None: nothing came any more."""
    message: str
    """What `stop` said is left to do."""


@lru_cache(maxsize=1)
def _stopped(subject: Subject) -> StoppedPress:
    """Press a second time, and stop at half the force as Ctrl-C does."""
    import numpy as np

    rig, sensor = _built(subject)
    with code_of("where", subject.package), rig.open(sensor, real_scene(), seed=2) as acquisition:
        found = pressing_channel(tuple(acquisition.reference))
        assert found is not None  # the first press had it
        stream, column = found
        rows: list[tuple[float, float]] = []
        blocks = iter(acquisition)

        def take(block: Any) -> None:
            if block.stream == stream.name:
                rows.extend(zip((1e-9 * block.t_ns).tolist(), block.data[:, column].tolist(), strict=True))

        try:
            for block in blocks:
                take(block)
                if rows and abs(np.mean([force for _, force in rows[-5:]])) > FORCE_N / 2:
                    break
        except KeyboardInterrupt:
            acquisition.stop("stopped by hand")
            raise
        pressed = len(rows)
        message = acquisition.stop("a check of plugins")
        for block in blocks:
            take(block)
    hold = [force for t_s, force in rows if t_s - rows[0][0] < HOLD_S]
    left = [force for _, force in rows[pressed:]]
    return StoppedPress(
        zero_n=_zero_n(acquisition),
        unloaded_n=float(np.mean(hold)) if hold else 0.0,
        left_n=float(np.mean(left[-5:])) if left else None,
        message=message,
    )


@check("rig", mode="invasive", level="silver", needs=("real-rig-presses", "real-rig-does-not-overshoot"))
def real_rig_lets_go(subject: Subject) -> None:
    """A rig that still presses when the next press begins takes that load for zero.

    Retreat at the end of each scene, also of one that failed, before the context of `open` is left.
    """
    first, second = _pressed(subject), _stopped(subject)
    for what, force in (("force", second.unloaded_n), ("zero", second.zero_n - first.zero_n)):
        if abs(force) > FORCE_SHARE * FORCE_N:
            fail("open", f"the {what} is {force:.3g} N off when the next press begins, before anything touches")


@check("rig", mode="invasive", level="silver", needs=("real-rig-lets-go",))
def real_rig_retreats_when_stopped(subject: Subject) -> None:
    """Whoever presses Ctrl-C wants the motor out, and a recording that says so.

    Let `stop` of the acquisition retreat, wait for the end of that, and return "" or what is to be done by hand.
    """
    found = _stopped(subject)
    if found.message:
        fail("stop", f"it says: {found.message}")
    if found.left_n is not None and abs(found.left_n) > FORCE_SHARE * FORCE_N:
        fail("stop", f"{found.left_n:.3g} N are left after it has returned")


CHECKS = (
    real_device_answers, real_rig_presses, real_rig_follows_the_profile, real_rig_does_not_overshoot, real_rig_lets_go,
    real_rig_retreats_when_stopped,
)  # fmt: skip

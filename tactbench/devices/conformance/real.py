"""Checks of the real devices and the real rig of a rig file: devices are read, the rig presses.

These checks run in the command's own process, so that Ctrl-C reaches the rig, and without a time limit.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from tactbench.core.conformance.check import Subject, check, code_of, fail, skip
from tactbench.core.conformance.press import REAL_N, WHY, slow_ramp, tiny_scene
from tactbench.core.conformance.streams import FORCE_SHARE, carried_out, force_is, good, joined, pressing_force
from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.rigs import load_rig_file, rig_context
from tactbench.core.samples import FloatArray
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.sensor import Nuisances
from tactbench.devices.conformance.driver import Opened, look_at
from tactbench.devices.rig_devices import open_driver

SECONDS, HOLD_S = 8.0, 1.0  # a motor that lifts off for the unloaded hold needs some of them to return to the skin
END, PEAK = 16, 99  # the end is the mean of the last sixteenth of the rows, the largest force a percentile
LARGEST = 1.5  # largest force over `REAL_N` (assumed: a loop that overshoots by half is badly tuned)
NOISY = 3.0  # factor by which a unit's noise may differ from the stated one (assumed: units and rooms differ by two)


def _file(subject: Subject) -> RigFile:
    if subject.rig_file is None:
        skip("no rig file is given; add `--rig-file FILE`")
    return load_rig_file(subject.rig_file, subject.registry)


@check("sensor", "device", mode="invasive", needs="code-names-resolve")
def real_device_answers(subject: Subject) -> None:
    """An emulator is only the author's model of a device; rate and noise at rest are measured on the real device.

    Let nothing touch the device. `tactbench doctor --rig-file FILE` shows ports, permissions and identities.
    """
    file = _file(subject)
    if subject.descriptor.driver is None:
        skip("its descriptor has no driver")
    named = {getattr(one, "device", name): one for name, one in file.entries().items()}
    if subject.name not in named:
        fail(str(subject.rig_file), f"the rig file has no entry for {subject.name}")
    entry = named[subject.name]
    if entry.emulated:
        skip("the device is emulated in the rig file")
    with code_of("driver", subject):
        driver = open_driver(subject.descriptor, entry, time.monotonic_ns)
    opened = Opened(subject, driver, time.monotonic_ns)
    try:
        opened.call("identify")
        found = look_at(opened)
    finally:
        with suppress(TactbenchError):
            driver.close()
    for name, stream in found.items():
        for column, channel in enumerate(stream.spec.channels):
            stated, sd = (
                getattr(subject.spec, "nuisances", {}).get(channel.kind, Nuisances()),
                float(np.nanstd(good(stream)[:, column])),
            )
            hidden, seen = stated.hidden(), channel.kind == "force" or stated.white.value > stated.step.value / 2
            if (seen and sd <= hidden / NOISY) or (hidden and sd > NOISY * hidden):
                text = (
                    f"the noise at rest is {sd:.3g} {channel.unit} (standard deviation)"
                    if sd
                    else "the channel is constant at rest: is it connected?"
                )
                fail(f"driver.read: {name}.{channel.name}", f"{text}; spec.nuisances states {hidden:.3g}")


def _zeros(drawn: Mapping[str, Any]) -> list[float]:
    """Return the zeros of the force sensor's channels, as noted in the recording by PressingForce.about."""
    texts = [str(text) for name, text in sorted(drawn.items()) if name.startswith("zero of ")]
    return [float(one) for text in texts for one in text.split(",")]


@check("rig", mode="invasive", needs="code-names-resolve")
def real_rig_presses(subject: Subject) -> None:
    """The recorded force must not be late, reversed or too large, and must return to zero after a press.

    Check limits by `tactbench doctor --rig-file FILE`, then sign and unit of the force sensor in the rig file, then the
    gains of the force loop. Retreat at the end of each scene, even after a failure; let `stop` retreat, wait until the
    retreat has ended, and return "" or the instruction for the operator.
    """
    file, first = _file(subject), list[Any]()
    if file.rig != subject.name:
        skip(f"the rig file is for the rig {file.rig}")
    sensor = subject.registry.sensors[next(iter(file.sensors))]
    scene = tiny_scene(profile=slow_ramp(REAL_N, SECONDS, HOLD_S))
    with code_of("where", subject):
        rig = subject.code("where")(rig_context(subject.registry, rig_file=file, operator=subject.operator))
        made = carried_out(rig, sensor, subject.descriptor, scene, rig_file=file, opened=first.append)
    if not hasattr(first[0], "stop"):
        return  # nothing in it moves by itself: a hand presses
    _, force_n = pressing_force(made.came, made.meta.reference)
    force_is("reference", float(force_n[-max(1, len(force_n) // END) :].mean()), REAL_N)
    largest = float(np.percentile(force_n, PEAK))
    if largest > LARGEST * REAL_N:
        fail("reference", f"the force rises to {largest:.3g} N in a press to {REAL_N:g} N")
    with code_of("where", subject), rig.open(sensor, scene, seed=2) as acquisition:
        every = (*acquisition.streams, *acquisition.reference)

        def force(*blocks: Any) -> FloatArray:
            return pressing_force(joined("open", every, blocks), acquisition.reference)[1]

        came, rising = iter(acquisition), []
        try:
            for block in came:
                rising.append(block)
                if np.abs(force(block)).max(initial=0.0) > REAL_N / 2:
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
    if abs(off_n) > FORCE_SHARE * REAL_N:
        fail("open", f"the force or its zero is {off_n:.3g} N off at the start of the next press, before contact")
    if message or (len(left) and abs(left.mean()) > FORCE_SHARE * REAL_N):
        fail("stop", message or f"{left.mean():.3g} N are left after the retreat")

"""Checks of the real devices of a rig file, which are read or press.

They run in the process of the command, so that Ctrl-C reaches the rig, and without a limit of time.
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
        skip("no rig file is given: `--rig-file FILE` names the devices")
    return load_rig_file(subject.rig_file, subject.registry)


@check("sensor", "device", mode="invasive", needs="code-names-resolve")
def real_device_answers(subject: Subject) -> None:
    """The emulator is the author's model of the device; rate and noise at rest are measured on the device.

    Let nothing touch it. Look at `tactbench doctor --rig-file FILE` for ports, permissions and identities.
    """
    file = _file(subject)
    if subject.descriptor.driver is None:
        skip("it names no driver")
    named = {getattr(one, "device", name): one for name, one in file.entries().items()}
    if subject.name not in named:
        fail(str(subject.rig_file), f"it has no entry for {subject.name}")
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
                    f"its noise at rest is {sd:.3g} {channel.unit} (sd)"
                    if sd
                    else "it is constant at rest: is it connected?"
                )
                fail(f"driver.read: {name}.{channel.name}", f"{text}; spec.nuisances states {hidden:.3g}")


def _zeros(drawn: Mapping[str, Any]) -> list[float]:
    """Return the zeros of the reference's channels, from the facts of PressingForce.about."""
    texts = [str(text) for name, text in sorted(drawn.items()) if name.startswith("zero of ")]
    return [float(one) for text in texts for one in text.split(",")]


@check("rig", mode="invasive", needs="code-names-resolve")
def real_rig_presses(subject: Subject) -> None:
    """Estimators learn the recorded force: it must not be late, of another sign or too large, nor remain afterwards.

    Look at `tactbench doctor --rig-file FILE` for limits, at the sign and unit of the force sensor in the rig file,
    then at the gains of the force loop. Retreat at the end of each scene, also of one that failed; let `stop` retreat,
    wait for its end, and return "" or what is to be done by hand.
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
        fail("open", f"the force or its zero is {off_n:.3g} N off when the next press begins, before anything touches")
    if message or (len(left) and abs(left.mean()) > FORCE_SHARE * REAL_N):
        fail("stop", message or f"{left.mean():.3g} N are left after it has returned")

"""Checks of what a tiny press gives, looked at as a recording would be; and of rigs before they press."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactbench.core.conformance.check import check, code_of, fail, skip
from tactbench.core.conformance.common import difference
from tactbench.core.conformance.subject import Subject
from tactbench.core.conformance.trial_press import (
    FORCE_N,
    SECONDS,
    TrialPress,
    carried_out,
    pressed,
    simulated_sensors,
    tiny_scene,
)
from tactbench.core.errors import TactbenchError
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.samples import Quality
from tactbench.core.spec.sensor import StreamSpec

FORCE_SHARE = 0.2
"""Of `FORCE_N`, by which the recorded force may differ at the end: newtons and gram-force differ by a hundred times."""
LATE_S = 1.5
"""A sample of time may be missing at either end of `SECONDS`, and a half more for a rig that begins later."""


@check(
    "sensor", "rig", needs=("finite-at-zero-load", "hdf5-round-trip", "code-names-resolve", "rig-builds"),
    level="silver",
)  # fmt: skip
def tiny_press_is_carried_out(subject: Subject) -> None:
    """One small press runs all that a campaign would: building, opening, skin, transducer, nuisances, converter.

    Correct what the message names; `tactbench twin explain` shows which effects take part.
    """
    made = pressed(subject)
    _has_samples(made, made.streams if subject.kind == "sensor" else made.every_stream)


def _has_samples(made: TrialPress, streams: Sequence[StreamSpec]) -> None:
    if not streams:
        fail("streams", "the press gave no stream")
    for stream in streams:
        rows = sum(len(one.data) for one in made.blocks if one.stream == stream.name)
        if not rows:
            fail(f"streams[{stream.name}]", "the press gave no sample of it")


_PRESSED = ("tiny-press-is-carried-out",)


@check("sensor", "rig", needs=_PRESSED, level="silver")
def blocks_fit_their_streams(subject: Subject) -> None:
    """A recording has a column a channel; a block of another width or of an unknown stream ends it.

    Yield blocks of shape (n, channels) for streams that the acquisition names.
    """
    import numpy as np

    made = pressed(subject)
    known = {stream.name: stream for stream in made.every_stream}
    own = {stream.name: stream for stream in made.sensor.spec.streams}
    for block in made.blocks:
        if block.stream not in known:
            fail(f"block of {block.stream}", f"the acquisition names only {', '.join(known)}")
        width = len(known[block.stream].channels)
        if np.shape(block.data) != (len(block.data), width):
            fail(f"streams[{block.stream}]", f"a block has shape {np.shape(block.data)}; (n, {width}) is needed")
        if block.t_ns is not None and np.shape(block.t_ns) != (len(block.data),):
            fail(f"streams[{block.stream}].t_ns", f"{np.shape(block.t_ns)} times for {len(block.data)} rows")
    for stream in made.streams:
        names = [channel.name for channel in own[stream.name].channels] if stream.name in own else []
        strange = [channel.name for channel in stream.channels if channel.name not in names]
        if strange:
            fail(f"streams[{stream.name}]", f"the sensor's spec has no channel {strange[0]} there")


@check("sensor", "rig", needs=_PRESSED, level="silver")
def clocks_go_forward(subject: Subject) -> None:
    """Rows are put on one clock by their times; a time that goes back cannot be.

    Count t_ns on in nanoseconds, over the device's own wraps as well.
    """
    import numpy as np

    made = pressed(subject)
    for stream in made.every_stream:
        t_ns = made.t_ns(stream.name)
        if t_ns is None:
            continue
        if t_ns.dtype.kind != "i":
            fail(f"streams[{stream.name}].t_ns", f"its type is {t_ns.dtype}, and whole nanoseconds are needed")
        back = np.flatnonzero(np.diff(t_ns) <= 0)
        if len(back):
            fail(f"streams[{stream.name}].t_ns", f"time does not go forward at row {int(back[0]) + 1}")


@check("sensor", "rig", needs=("clocks-go-forward",), level="silver")
def rates_are_as_stated(subject: Subject) -> None:
    """Windows and delays are computed from the stated rate.

    State the rate at which the rig samples in the acquisition's streams, in samples a second.
    """
    made = pressed(subject)
    for stream in made.every_stream:
        t_ns = made.t_ns(stream.name)
        if t_ns is None or len(t_ns) < 3:
            continue
        seconds = float(t_ns[-1] - t_ns[0]) * 1e-9
        rate = (len(t_ns) - 1) / seconds
        if stream.rate_hz is not None and abs(rate / stream.rate_hz - 1) > 0.05:
            fail(f"streams[{stream.name}].rate_hz", f"{stream.rate_hz:g} Hz is stated, the times say {rate:.4g} Hz")
        if not SECONDS / LATE_S <= seconds <= SECONDS * LATE_S:
            fail(f"streams[{stream.name}].t_ns", f"it spans {seconds:.3g} s, and the scene lasts {SECONDS:g} s")


@check("sensor", "rig", needs=_PRESSED, level="silver")
def samples_are_finite(subject: Subject) -> None:
    """An estimator cannot be taught with NaN; what is missing is said in the quality.

    Mark samples that mean nothing as Quality.MISSING, and compute the others.
    """
    import numpy as np

    made = pressed(subject)
    for stream in made.every_stream:
        there = (made.quality(stream.name) & Quality.MISSING) == 0
        bad = np.argwhere(~np.isfinite(made.values(stream.name)) & there)
        if len(bad):
            row, column = bad[0]
            fail(f"streams[{stream.name}].channels[{stream.channels[column].name}]", f"it is not finite in row {row}")


@check("sensor", "rig", needs=_PRESSED, level="silver")
def limits_are_kept(subject: Subject) -> None:
    """A converter gives nothing beyond its ends, and what stands at an end is marked as saturated.

    Clip to lower and upper, and mark those samples as Quality.SATURATED.
    """
    import numpy as np

    made = pressed(subject)
    for stream in made.streams:
        values, quality = made.values(stream.name), made.quality(stream.name)
        for column, channel in enumerate(stream.channels):
            where = f"streams[{stream.name}].channels[{channel.name}]"
            low = -math.inf if channel.lower is None else channel.lower
            high = math.inf if channel.upper is None else channel.upper
            beyond = (values[:, column] < low) | (values[:, column] > high)
            if beyond.any():
                fail(where, f"it reads {values[beyond, column][0]:g}, beyond its limits {low:g} to {high:g}")
            # One that rests at an end has that reading without being full.
            rest = None if channel.rest is None else channel.rest.to(channel.unit)
            ends = [end for end in (low, high) if end != rest]
            at_end = np.isin(values[:, column], ends)
            unmarked = at_end & ((quality[:, column] & Quality.SATURATED) == 0)
            if channel.unit == "count" and np.count_nonzero(unmarked):
                fail(where, f"it stands at its end in row {int(np.flatnonzero(unmarked)[0])}, not marked SATURATED")


@check("sensor", needs=("limits-are-kept",), level="silver")
def gentle_press_is_within_range(subject: Subject) -> None:
    """A sensor at its end under half a newton measures nothing: usually a factor of a thousand in a sensitivity.

    Look at the units of the sensitivity: a SkinState has N, mm and MPa.
    """
    made = pressed(subject)
    marks = [made.quality(stream.name) for stream in made.streams if stream.channels[0].kind == "taxel"]
    full = [bool(((one[-1] & Quality.SATURATED) != 0).all()) for one in marks]
    if full and all(full):
        fail("transducer", f"every taxel stands at its converter's end under {FORCE_N:g} N")


@check("sensor", "rig", needs=_PRESSED, level="silver")
def same_seed_same_samples(subject: Subject) -> None:
    """`rerun` must give the same bytes; whatever is drawn comes from a generator made of the run's seed.

    Draw from numpy.random.default_rng([seed, …]) that is made for the scene, never from a global generator.
    """
    import numpy as np

    first, again = pressed(subject), _pressed_anew(subject)
    for stream in first.every_stream:
        a, b = first.values(stream.name), again.values(stream.name)
        if a.shape != b.shape or not np.array_equal(a, b, equal_nan=True):
            fail(f"streams[{stream.name}]", "another press with the same seed gives other samples")


def _pressed_anew(subject: Subject) -> TrialPress:
    """Return the same press, carried out once more."""
    return pressed.__wrapped__(subject)


@check("rig", needs=("same-seed-same-samples",), level="silver")
def other_seed_other_samples(subject: Subject) -> None:
    """Replicates are the campaign with everything drawn again; where the seed is ignored, they are one and the same.

    Make the scene's generator from the `seed` of `open`.
    """
    import numpy as np

    first, other = pressed(subject), pressed(subject, 2)
    if all(np.array_equal(first.values(one.name), other.values(one.name)) for one in first.every_stream):
        fail("open(…, seed)", "two seeds give the same samples in every stream")


_SOUND = ("blocks-fit-their-streams", "clocks-go-forward", "samples-are-finite", "limits-are-kept")


@check("sensor", "rig", needs=_SOUND, level="silver")
def press_is_recorded(subject: Subject) -> None:
    """What a rig gives is written to a file and read back before anybody computes with it.

    Correct what the message names; `tactbench inspect FILE` shows the same findings.
    """
    from tactbench.core.recording.health import examine
    from tactbench.core.recording.reader import open_recording
    from tactbench.core.recording.writer import RecordingWriter
    from tactbench.core.spec.recording import RecordingMeta

    made = pressed(subject)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tiny.h5"
        try:
            spec = made.sensor.spec.model_copy(update={"streams": made.streams})
            meta = RecordingMeta(
                name="tiny", sensor=spec, reference=made.reference, rig=made.rig.name, simulated=True,
                clock="simulated", plan=made.plan, scene=made.scene, seed=1, **made.said,
            )  # fmt: skip
            with RecordingWriter(path, meta) as writer:
                for block in made.blocks:
                    writer.append(block)
            with open_recording(path) as recording:
                wrong = [finding for finding in examine(recording) if finding.severity == "error"]
        except (TactbenchError, ValueError) as error:
            fail("recording", str(error))
    if wrong:
        fail(f"streams[{wrong[0].stream}]", f"the recording is not healthy: {wrong[0].message}")


@check("rig", needs=("blocks-fit-their-streams",), level="silver")
def force_is_recorded(subject: Subject) -> None:
    """A task of force asks for the channel of kind ``force`` among the reference streams, in newtons.

    Give a reference stream with a channel of kind "force", unit "N", sign 1, called fz or normal.
    """
    made = pressed(subject)
    found = [(stream, channel) for stream in made.reference for channel in stream.channels if channel.kind == "force"]
    if not found:
        fail("reference", "it has no channel of kind force")
    for stream, channel in found:
        if channel.unit != "N":
            fail(f"reference[{stream.name}].channels[{channel.name}].unit", f"{channel.unit!r}, and 'N' is needed")
    if len(found) > 1 and not {"fz", "normal"}.intersection(channel.name for _, channel in found):
        fail("reference", "none of its force channels is called fz or normal: which one is pressed with?")


def pressing_channel(reference: Sequence[StreamSpec]) -> tuple[StreamSpec, int] | None:
    """Return the stream and column of the pressing force; None: there is no such channel."""
    for stream in reference:
        for column, channel in enumerate(stream.channels):
            if channel.kind == "force" and channel.name in ("fz", "normal"):
                return stream, column
    return None


@check("rig", needs=("force-is-recorded",), level="silver")
def force_follows_the_profile(subject: Subject) -> None:
    """The recorded force is what estimators are taught: in another unit, or with another sign, every score is wrong.

    Record newtons, positive where the sensor is pressed; a gram-force is 0.00981 N.
    """
    made = pressed(subject)
    end = made.scene.profile.end.to("N")
    found = pressing_channel(made.reference)
    if found is None:  # one force channel of another name, which force-is-recorded lets pass
        return
    stream, column = found
    force = float(made.values(stream.name)[-5:, column].mean())
    if abs(force - end) > FORCE_SHARE * end:
        factor = force / end
        meant = ": are these gram-force?" if 80 < factor < 125 else ": is its sign turned?" if factor < 0 else ""
        fail(
            f"reference[{stream.name}].channels[{stream.channels[column].name}]",
            f"it says {force:.4g} at the end of a press to {end:g} N{meant}",
        )


@check("rig", needs=_PRESSED, level="silver")
def scene_is_not_changed(subject: Subject) -> None:
    """One scene is carried out many times, and stands in every recording.

    Copy what you change: ``scene.model_copy(update=…)``.
    """
    rig, descriptor = _built(subject), subject.descriptor
    sensor = simulated_sensors(subject)[0]
    scene = tiny_scene(labels={"told": 1})
    before = (scene.model_dump(mode="json"), sensor.model_dump(mode="json"))
    with code_of("where", subject.package):
        carried_out(rig, descriptor, sensor, scene, 1)
    place = difference(before[0], scene.model_dump(mode="json"), "scene")
    place = place or difference(before[1], sensor.model_dump(mode="json"), "sensor")
    if place:
        fail(place, "the rig has changed it")


@check("rig", needs=_PRESSED, level="silver")
def plan_says_why(subject: Subject) -> None:
    """A simulation says which effects it includes and which it leaves out; without reasons nobody can judge that.

    Give every PlanEntry a reason, and every number in `assumptions` and `drawn` by a name.
    """
    made = pressed(subject)
    for entry in made.plan:
        if not entry.reason.strip():
            fail(f"plan[{entry.effect}].reason", "it is empty")
    for field, said in made.said.items():
        for name, value in said.items():
            if not isinstance(name, str) or not isinstance(value, (str, int, float)):
                fail(f"{field}[{name}]", f"a {type(value).__name__}, and a text or a number is needed")


@check("rig", needs=("code-names-resolve",))
def rig_builds(subject: Subject) -> None:
    """A rig is built from a RigContext before anything else; one that needs a file or a folder says so.

    Raise UsageError for what is missing, and return an object with open() or recordings().
    """
    from tactbench.core.errors import UsageError

    try:
        rig = _built(subject, usage=True)
    except UsageError as error:
        skip(f"it needs more than the check gives: {error.message}")
    if not (hasattr(rig, "open") or hasattr(rig, "recordings")):
        fail("where", f"it returned a {type(rig).__name__} with neither open() nor recordings()")


def _built(subject: Subject, *, usage: bool = False) -> Any:
    from tactbench.core.errors import UsageError

    context = rig_context(subject.registry)
    with code_of("where", subject.package):
        try:
            return subject.code("where")(context)
        except UsageError as error:
            if not usage:
                raise
            caught = error
    raise caught


@check("rig")
def rungs_are_named_once(subject: Subject) -> None:
    """A run asks for a rung by its name, and the cheapest that keeps a tolerance is taken in their order.

    Name each rung once, the cheapest first; only simulated rigs have them.
    """
    rungs = subject.descriptor.rungs
    doubled = sorted({name for name in rungs if rungs.count(name) > 1})
    if doubled:
        fail("rungs", f"{doubled[0]!r} stands there twice")
    if rungs and not subject.descriptor.simulated:
        fail("rungs", "the rig is not simulated")


@check("rig", needs=("code-names-resolve",), may_skip=True)
def rig_file_is_a_model(subject: Subject) -> None:
    """Complaints about a rig file name its line where its class says what belongs into it.

    Let `file` name a subclass of tactbench.plugin.devices.RigFile.
    """
    from tactbench.core.spec.rig_file import RigFile

    if subject.descriptor.file is None:
        skip("it names no class for its rig file")
    found = subject.code("file")
    if not (isinstance(found, type) and issubclass(found, RigFile)):
        fail("file", f"{subject.descriptor.file} is no subclass of RigFile")


CHECKS = (
    rig_builds, rungs_are_named_once, rig_file_is_a_model, tiny_press_is_carried_out,
    blocks_fit_their_streams, clocks_go_forward, rates_are_as_stated, samples_are_finite, limits_are_kept,
    gentle_press_is_within_range, same_seed_same_samples, other_seed_other_samples, press_is_recorded,
    force_is_recorded, force_follows_the_profile, scene_is_not_changed, plan_says_why,
)  # fmt: skip

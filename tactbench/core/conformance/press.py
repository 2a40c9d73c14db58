"""Checks of what a small press on a simulated rig gives, looked at as a recording would be; and of rigs' forces."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import CheckFailed, Subject, check, code_of, fail, skip
from tactbench.core.errors import NotApplicable
from tactbench.core.plugins.registry import load_object
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.samples import Block, Quality
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Environment, Scene
from tactbench.core.spec.sensor import StreamSpec

if TYPE_CHECKING:
    import numpy.typing as npt

    from tactbench.core.samples import FloatArray

FORCE_N = 0.5
"""At the end of the press: every sensor that is touched by a hand bears it."""
SECONDS = 1.0
LATE_S = 1.5
"""A sample of time may be missing at either end of `SECONDS`, and a half more for a rig that begins later."""
NOISE_N = 0.005
"""Of the reference force: a hundredth of the press, so that draws can be told apart and the force still be read."""
FORCE_SHARE = 0.2
"""Of `FORCE_N`, by which the recorded force may differ at the end: newtons and gram-force differ by a hundred times."""
RATE_SHARE = 0.05
RANGE_N = 2.0
"""What the task `force` presses to where it is not installed."""
MOST_SATURATED = 0.5
"""Share of the samples of a press over the task's range that the channel which is worst off may stand at a limit."""
WHY = "a check of plugins"
UNITS_OF_TIME = {1e-9: "seconds", 1e-6: "milliseconds", 1e-3: "microseconds"}


def tiny_scene(name: str = "tiny", end_n: float = FORCE_N, **changes: Any) -> Scene:
    """Return a press of a second to half a newton, with everything else as scenes have it."""
    ramp = ForceRamp(
        end=assumed(end_n, "N", WHY), hold=assumed(SECONDS / 5, "s", WHY), duration=assumed(SECONDS, "s", WHY),
        samples=100,
    )  # fmt: skip
    environment = Environment(force_noise=assumed(NOISE_N, "N", WHY))
    return Scene(name=name, profile=ramp, environment=environment).model_copy(update=changes)


@dataclass(frozen=True)
class TrialPress:
    """What a rig gave for a scene."""

    scene: Scene
    sensor: SensorDescriptor
    rig: RigDescriptor
    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    about: Mapping[str, Any]
    """Its plan, its assumptions and what it has drawn."""
    blocks: tuple[Block, ...]

    @property
    def every_stream(self) -> tuple[StreamSpec, ...]:
        """The sensor's streams, then those of the reference."""
        return (*self.streams, *self.reference)

    def values(self, stream: str) -> FloatArray:
        """Return the (n, channels) samples of a stream."""
        import numpy as np

        return np.concatenate([np.asarray(one.data, dtype=np.float64) for one in self.blocks if one.stream == stream])

    def quality(self, stream: str) -> npt.NDArray[Any]:
        """Return the (n, channels) marks of a stream."""
        import numpy as np

        return np.concatenate([marks_of(one) for one in self.blocks if one.stream == stream])


def marks_of(block: Block) -> npt.NDArray[Any]:
    """Return the (n, channels) marks of a block; one without any is good."""
    import numpy as np

    return np.zeros(np.shape(block.data), np.uint8) if block.quality is None else block.quality


def carried_out(rig: Any, descriptor: RigDescriptor, sensor: SensorDescriptor, scene: Scene, seed: int) -> TrialPress:
    """Carry out a scene on a rig that was built; raises what the rig raises."""
    with rig.open(sensor, scene, seed=seed) as one:
        streams, reference, blocks = tuple(one.streams), tuple(one.reference), tuple(one)
        about = {"plan": tuple(one.plan), "assumptions": dict(one.assumptions), "drawn": dict(one.drawn)}
    return TrialPress(scene, sensor, descriptor, streams, reference, about, blocks)


def simulated_rig(subject: Subject) -> tuple[Any, RigDescriptor]:
    """Return the first simulated rig, built, those that come with this package before others."""
    simulated = [one for one in subject.registry.rigs.all_owned() if one.descriptor.simulated]
    if not simulated:
        skip("no simulated rig is installed")
    descriptor = min(simulated, key=lambda one: not one.ours).descriptor
    return load_object(descriptor.where)(rig_context(subject.registry)), descriptor


def simulated_sensors(subject: Subject) -> Sequence[SensorDescriptor]:
    """Return sensors that a simulation can press: of this package, the cheapest first, then of the plugin's own."""
    able = []
    for owned in subject.registry.sensors.all_owned():
        skin = owned.descriptor.spec.skin
        near = owned.ours or owned.distribution == subject.distribution
        if near and skin is not None and owned.descriptor.transducer is not None:
            cost = len(owned.descriptor.spec.channels()) * math.prod(skin.sheet.cells)
            able.append((not owned.ours, cost, owned.descriptor.name, owned.descriptor))
    if not able:
        skip("no sensor that can be simulated is installed")
    return [one[-1] for one in sorted(able, key=lambda one: one[:3])]


def presses(subject: Subject, scenes: Sequence[Scene], field: str) -> Iterator[TrialPress]:
    """Yield what every simulated sensor and scene that go with each other give."""
    rig, descriptor = simulated_rig(subject)
    for scene in scenes:
        for sensor in simulated_sensors(subject):
            try:
                with code_of(field, subject):
                    yield carried_out(rig, descriptor, sensor, scene, 1)
            except CheckFailed as failure:
                if not isinstance(failure.__cause__, NotApplicable):
                    raise


@lru_cache(maxsize=6)
def pressed(subject: Subject, seed: int = 1) -> TrialPress:
    """Return a press: of a sensor on a simulated rig over the range of the task `force`, or of a rig, a tiny one."""
    end_n = FORCE_N
    if subject.kind == "sensor":
        rig, descriptor = simulated_rig(subject)
        sensor, field = subject.descriptor, "spec"
        scenes = subject.registry.tasks["force"].spec.scenes if "force" in subject.registry.tasks else ()
        end_n = max((one.scene.profile.largest_n for one in scenes), default=RANGE_N)
    else:
        sensor, descriptor, field = simulated_sensors(subject)[0], subject.descriptor, "where"
        rig = _built(subject)
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels()))
    with code_of(field, subject):
        scene = tiny_scene(end_n=end_n, observe=("taxel",) if "taxel" in kinds else kinds)
        return carried_out(rig, descriptor, sensor, scene, seed)


def _built(subject: Subject) -> Any:
    if not subject.descriptor.simulated:
        skip("it moves something real, or replays: `--rig-file FILE` presses with it")
    with code_of("where", subject):
        return subject.code("where")(rig_context(subject.registry))


@check("sensor", "rig", needs=("transducer-reads", "rest-is-as-stated", "code-names-resolve"))
def blocks_fit_their_streams(subject: Subject) -> None:
    """A recording has a column a channel, and only numbers; one press runs all that a campaign would.

    Yield blocks of shape (n, channels) for streams that the acquisition names; mark what means nothing as MISSING.
    """
    import numpy as np

    made = pressed(subject)
    known = {stream.name: stream for stream in made.every_stream}
    own = {stream.name: {one.name for one in stream.channels} for stream in made.sensor.spec.streams}
    for block in made.blocks:
        if block.stream not in known:
            fail(f"block of {block.stream}", f"the acquisition names only {', '.join(known)}")
        channels = known[block.stream].channels
        if np.shape(block.data) != (len(block.data), len(channels)):
            text = f"a block has shape {np.shape(block.data)}; (n, {len(channels)}) is needed"
            fail(f"streams[{block.stream}]", text)
        bad = np.argwhere(~np.isfinite(block.data) & ((marks_of(block) & Quality.MISSING) == 0))
        if len(bad):
            fail(f"streams[{block.stream}].channels[{channels[bad[0][1]].name}]", "it is not finite, and not marked")
    for stream in made.streams:
        strange = [one.name for one in stream.channels if one.name not in own.get(stream.name, ())]
        if strange:
            fail(f"streams[{stream.name}]", f"the sensor's spec has no channel {strange[0]} there")
    for name in known:
        if not any(len(one.data) for one in made.blocks if one.stream == name):
            fail(f"streams[{name}]", "the press gave no sample of it")


@check("sensor", "rig", needs=("blocks-fit-their-streams",))
def clocks_are_in_nanoseconds(subject: Subject) -> None:
    """Rows are put on one clock by their times; windows and delays are computed from the stated rate.

    Count t_ns on in whole nanoseconds, and state the rate in samples a second.
    """
    import numpy as np

    made = pressed(subject)
    for stream in made.every_stream:
        where = f"streams[{stream.name}]"
        times = [one.t_ns for one in made.blocks if one.stream == stream.name and one.t_ns is not None]
        if not times:
            continue
        t_ns = np.concatenate(times)
        spans = float(t_ns[-1] - t_ns[0]) * 1e-9
        named_unit(f"{where}.t_ns", spans / SECONDS)
        if t_ns.dtype.kind != "i" or len(t_ns) != len(made.values(stream.name)):
            fail(f"{where}.t_ns", f"{len(t_ns)} of {t_ns.dtype}: a whole number of nanoseconds a row is needed")
        back = np.flatnonzero(np.diff(t_ns) <= 0)
        if len(back):
            fail(f"{where}.t_ns", f"time does not go forward at row {int(back[0]) + 1}")
        rate = (len(t_ns) - 1) / spans
        if stream.rate_hz is not None and len(t_ns) > 2 and abs(rate / stream.rate_hz - 1) > RATE_SHARE:
            fail(f"{where}.rate_hz", f"{stream.rate_hz:g} Hz is stated, the times say {rate:.4g} Hz")
        if not 1 / LATE_S <= spans / SECONDS <= LATE_S:
            fail(f"{where}.t_ns", f"it spans {spans:.3g} s, and the scene lasts {SECONDS:g} s")


def named_unit(where: str, share: float) -> None:
    """Fail if times, as a share of what they are in nanoseconds, are in another unit."""
    for factor, unit in UNITS_OF_TIME.items():
        if 0.5 < share / factor < 2:
            fail(where, f"it is in {unit}, and nanoseconds are needed")


@check("sensor", "rig", needs=("clocks-are-in-nanoseconds",), carries_out=True)
def limits_are_kept(subject: Subject) -> None:
    """A converter gives nothing beyond its ends, and what stands at an end is marked as saturated.

    Clip to lower and upper, and mark those samples as Quality.SATURATED.
    """
    import numpy as np

    made = pressed(subject)
    for stream in made.streams:
        for channel, values, marks in zip(
            stream.channels, made.values(stream.name).T, made.quality(stream.name).T, strict=True
        ):
            where = f"streams[{stream.name}].channels[{channel.name}]"
            low = -math.inf if channel.lower is None else channel.lower
            high = math.inf if channel.upper is None else channel.upper
            beyond = values[(values < low) | (values > high)]
            if len(beyond):
                fail(where, f"it reads {beyond[0]:g}, beyond its limits {low:g} to {high:g}")
            # One that rests at an end has that reading without being full.
            rest = None if channel.rest is None else channel.rest.to(channel.unit)
            at_end = np.isin(values, [end for end in (low, high) if end != rest])
            if channel.unit == "count" and np.any(at_end & ((marks & Quality.SATURATED) == 0)):
                fail(where, "it stands at its end, not marked SATURATED")


@check("sensor", needs=("limits-are-kept",))
def range_of_the_task_is_measured(subject: Subject) -> None:
    """A channel that stands at its limit tells nothing: usually a sensitivity that is off by a factor of ten or more.

    Look at the units of the sensitivity: a SkinState has N, mm and MPa.
    """
    import numpy as np

    made = pressed(subject)
    for stream in made.streams:
        full = np.mean((made.quality(stream.name) & Quality.SATURATED) != 0, axis=0)
        worst = int(np.argmax(full))
        if stream.channels[worst].kind == "taxel" and full[worst] > MOST_SATURATED:
            text = f"{full[worst]:.0%} of its samples stand at a limit in a press to {made.scene.profile.largest_n:g} N"
            fail(f"transducer: {stream.channels[worst].name}", text)


@check("rig", needs=("blocks-fit-their-streams",))
def seeds_decide(subject: Subject) -> None:
    """The same seed must give the same bytes, and another one a replicate with everything drawn again.

    Draw from a generator that `open` makes of its `seed`, never from a global one.
    """
    import numpy as np

    first, again, other = pressed(subject), pressed.__wrapped__(subject), pressed(subject, 2)
    names = [stream.name for stream in first.every_stream]
    for name in names:
        if not np.array_equal(first.values(name), again.values(name), equal_nan=True):
            fail(f"streams[{name}]", "another press with the same seed gives other samples")
    if all(np.array_equal(first.values(name), other.values(name)) for name in names):
        fail("open(…, seed)", "two seeds give the same samples in every stream")


@check("rig", needs=("blocks-fit-their-streams",))
def force_follows_the_profile(subject: Subject) -> None:
    """The recorded force is what estimators are taught: in another unit, or with another sign, every score is wrong.

    Give a reference stream with a channel of kind "force", unit "N", called fz or normal, positive where it presses.
    """
    made = pressed(subject)
    found = pressing_channel(made.reference)
    if found is None:
        fail("reference", "it has no channel of kind force called fz or normal")
    stream, column = found
    where = f"reference[{stream.name}].channels[{stream.channels[column].name}]"
    if stream.channels[column].unit != "N":
        fail(f"{where}.unit", f"{stream.channels[column].unit!r}, and 'N' is needed")
    force_is(where, float(made.values(stream.name)[-5:, column].mean()), FORCE_N)


def force_is(where: str, found_n: float, meant_n: float) -> None:
    """Fail where a force at the end of a press is another one, and say which mistake makes it so."""
    if abs(found_n - meant_n) > FORCE_SHARE * meant_n:
        factor = found_n / meant_n
        meant = (
            "gram-force" if 80 < factor < 125
            else "kilograms" if 0.09 < factor < 0.11
            else "millinewtons" if 800 < factor < 1250
            else ""
        )  # fmt: skip
        likely = f": are these {meant}?" if meant else ": is its sign turned?" if factor < 0 else ""
        fail(where, f"{found_n:.4g} N at the end of a press to {meant_n:g} N{likely}")


def pressing_channel(reference: Sequence[StreamSpec]) -> tuple[StreamSpec, int] | None:
    """Return the stream and column of the pressing force; None: there is no such channel."""
    for stream in reference:
        for column, channel in enumerate(stream.channels):
            if channel.kind == "force" and channel.name in ("fz", "normal"):
                return stream, column
    return None

"""The twin as a rig: opens a scene, applies its plan, hands out blocks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.plugin import (
    Block,
    ChannelSpec,
    EffectDescriptor,
    FloatArray,
    NotApplicable,
    PlanEntry,
    RigContext,
    RigError,
    Scalar,
    Scene,
    SensorDescriptor,
    SensorSpec,
    Source,
    StreamSpec,
    load_object,
)
from tactbench.rigs.twin.geometry import Contact, radius_mm
from tactbench.rigs.twin.planner import Plan, plan_scene
from tactbench.rigs.twin.synthesis import Load, Synthesis, Track

ROWS_PER_BLOCK = 1000
REFERENCE_STREAM = "force_torque"
_ONE_CLOCK = Source(
    tag="assumed",
    reference="the twin samples the sensor and the force sensor at once, on the scene's reference clock, as the "
    "embedded system of Karl et al. 2016 does (5000 samples in 60 s)",
)


_OWN_CLOCK_FROM = 2.0
"""A stream this many times faster than the sensor's slowest keeps its own clock: it is there to see fast things."""


class Samples(NamedTuple):
    """What one stream of a recording holds."""

    t_ns: npt.NDArray[np.int64]
    """(n,) nanoseconds since the first sample."""
    data: npt.NDArray[np.generic]
    """(n, channels)"""
    quality: npt.NDArray[np.uint8] | None
    """(n, channels); None: all good."""


@dataclass(frozen=True)
class TwinAcquisition:
    """One simulated recording: iterate it for blocks."""

    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    assumptions: Mapping[str, Scalar]
    drawn: Mapping[str, Scalar]
    samples: Mapping[str, Samples] = field(repr=False)
    """By name of the stream."""

    def __iter__(self) -> Iterator[Block]:
        """Yield blocks, the streams in turn, each up to the same moment, as samples taken at once would arrive."""
        reference = self.samples[REFERENCE_STREAM].t_ns
        given = dict.fromkeys(self.samples, 0)
        for start in range(0, reference.size, ROWS_PER_BLOCK):
            last = start + ROWS_PER_BLOCK >= reference.size
            until = None if last else reference[start + ROWS_PER_BLOCK]
            for stream in (*self.streams, *self.reference):
                own, first = self.samples[stream.name], given[stream.name]
                end = own.t_ns.size if until is None else int(np.searchsorted(own.t_ns, until))
                rows = slice(first, end)
                given[stream.name] = end
                if end > first:
                    quality = None if own.quality is None else own.quality[rows]
                    yield Block(stream=stream.name, t_ns=own.t_ns[rows], data=own.data[rows], quality=quality)


class Twin:
    """The simulated rig.

    Parameters
    ----------
    effects
        All installed effects; a plan takes from them what a scene calls for.
    """

    def __init__(self, effects: Sequence[EffectDescriptor]) -> None:
        self.effects = tuple(effects)

    def explain(self, sensor: SensorDescriptor, scene: Scene) -> Plan:
        """Return the plan of a scene without carrying it out.

        Entries that only the solve can decide (the core) are as announced; ``open`` settles them.
        """
        if sensor.spec.skin is None or sensor.transducer is None:
            missing = "skin" if sensor.spec.skin is None else "transducer"
            raise NotApplicable(
                f"{sensor.name} declares no {missing}: it can be recorded or replayed, not simulated.",
                hint="Declare a skin and a transducer in the sensor's plugin.",
            )
        return plan_scene(self.effects, scene, sensor.spec)

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[TwinAcquisition]:
        """Carry out `scene` with `sensor`; the same seed gives the same bits.

        Raises
        ------
        NotApplicable
            If the twin does not model the sensor or an observed kind of channel.
        RigError
            If the contact cannot be resolved or solved.
        """
        plan = self.explain(sensor, scene)
        run = _prepare(sensor, scene, seed, plan)
        for effect in plan.stages:
            load_object(effect.where)(run)
        yield _acquisition(run, plan)


def build(context: RigContext) -> Twin:
    """Return the twin with the installed effects."""
    return Twin(context.effects)


def _prepare(sensor: SensorDescriptor, scene: Scene, seed: int, plan: Plan) -> Synthesis:
    t_s, load = _load(scene)
    run = Synthesis(
        sensor=sensor,
        scene=scene,
        seed=seed,
        t_s=t_s,
        load=load,
        tracks=tuple(_tracks(sensor.spec, scene, plan, t_s, load)),
        contact=Contact(radius_mm(scene.indenter), 0.0, 0.0),
        reference_n=load.at(t_s),
        lent=dict(plan.lent),
    )
    run.contact = _place(run)
    return run


def _load(scene: Scene) -> tuple[FloatArray, Load]:
    """Return the reference clock and the true force: held at the start, then straight to the end."""
    profile = scene.profile
    duration, hold = profile.duration.to("s"), profile.hold.to("s")
    start, end = profile.start.to("N"), profile.end.to("N")
    if not duration > 0 or hold < 0 or min(start, end) < 0:
        raise RigError(
            f"The scene {scene.name!r} asks for a ramp from {start:g} to {end:g} N within {duration:g} s after "
            f"{hold:g} s of rest.",
            hint="Duration must be positive, hold and forces at least zero.",
        )
    t_s: FloatArray = np.arange(profile.samples, dtype=np.float64) * (duration / profile.samples)
    if hold >= duration:
        return t_s, Load(np.array([0.0, duration]), np.array([start, start]))
    return t_s, Load(np.array([0.0, hold, duration]), np.array([start, start, end]))


def _tracks(spec: SensorSpec, scene: Scene, plan: Plan, t_s: FloatArray, load: Load) -> Iterator[Track]:
    """Yield the channels on the reference clock, then those of every stream that keeps its own."""
    duration = scene.profile.duration.to("s")
    slowest = min((stream.rate_hz for stream in spec.streams if stream.rate_hz is not None), default=math.inf)
    slow = tuple(stream for stream in spec.streams if (stream.rate_hz or 0.0) < _OWN_CLOCK_FROM * slowest)
    for clock, streams in (("", slow), *((stream.name, (stream,)) for stream in spec.streams if stream not in slow)):
        channels = tuple(channel for stream in streams for channel in stream.channels if channel.kind in plan.kinds)
        rate = streams[0].rate_hz if clock else None
        own = t_s if rate is None else np.arange(math.ceil(duration * rate), dtype=np.float64) / rate
        if channels:
            yield Track(
                clock=clock,
                channels=channels,
                t_s=own,
                force_n=load.at(own),
                readings=np.tile([_rest(channel) for channel in channels], (own.size, 1)),
                quality=np.zeros((own.size, len(channels)), dtype=np.uint8),
            )


def _rest(channel: ChannelSpec) -> float:
    return 0.0 if channel.rest is None else channel.rest.to(channel.unit)


def _place(run: Synthesis) -> Contact:
    """Return where the indenter meets the skin: nominal point, commanded offset, and this mounting's own scatter."""
    placement, spec = run.scene.placement, run.sensor.spec
    if spec.skin is None:
        raise NotApplicable(f"{spec.name} declares no skin.")
    sheet = spec.skin.sheet
    middle = (sheet.x_min.to("mm") + sheet.x_max.to("mm")) / 2
    nominal_x = spec.parameters["contact_x"].to("mm") if "contact_x" in spec.parameters else middle
    nominal_s = spec.parameters["contact_s"].to("mm") if "contact_s" in spec.parameters else 0.0
    scatter = placement.scatter.to("mm")
    off_x, off_s = scatter * run.of_recording("placement").standard_normal(2)
    x, s = nominal_x + placement.x.to("mm") + off_x, nominal_s + placement.s.to("mm") + off_s
    run.drawn.update(placement_x_mm=float(x), placement_s_mm=float(s))
    tilt_x, tilt_s = (math.tan(tilt.to("rad")) for tilt in (placement.tilt_x, placement.tilt_s))
    return Contact(run.contact.radius_mm, float(x), float(s), tilt_x, tilt_s)


def _acquisition(run: Synthesis, plan: Plan) -> TwinAcquisition:
    profile = run.scene.profile
    rate = profile.samples / profile.duration.to("s")
    streams: list[StreamSpec] = []
    samples: dict[str, Samples] = {}
    for track in run.tracks:
        columns = {channel.name: column for column, channel in enumerate(track.channels)}
        for stream in run.sensor.spec.streams:
            kept = tuple(channel for channel in stream.channels if channel.name in columns)
            if not kept:
                continue
            own = [columns[channel.name] for channel in kept]
            clock = {} if track.clock else {"rate_hz": rate, "rate_source": _ONE_CLOCK}
            streams.append(stream.model_copy(update={"channels": kept, **clock}))
            stored = _stored(track.readings[:, own], stream, kept)
            samples[stream.name] = Samples(_ns(track.t_s), stored, track.quality[:, own])
    reference = StreamSpec(
        name=REFERENCE_STREAM,
        rate_hz=rate,
        rate_source=_ONE_CLOCK,
        channels=(
            ChannelSpec(name="fz", kind="force", unit="N", sign=1),
            *(channel for channel, _ in run.reference_more.values()),
        ),
    )
    measured = np.column_stack([run.reference_n, *(values for _, values in run.reference_more.values())])
    samples[REFERENCE_STREAM] = Samples(_ns(run.t_s), measured, None)
    environment = run.scene.environment
    return TwinAcquisition(
        streams=tuple(streams),
        reference=(reference,),
        plan=plan.settled(run.settled),
        assumptions={
            "placement_scatter_mm": run.scene.placement.scatter.to("mm"),
            "drift_scale": environment.drift_scale,
            "noise_scale": environment.noise_scale,
            "session_offset_scale": environment.session_offset_scale,
            "since_power_on_s": environment.since_power_on.to("s"),
            "force_noise_n": environment.force_noise.to("N"),
        },
        drawn=dict(run.drawn),
        samples=samples,
    )


def _ns(t_s: FloatArray) -> npt.NDArray[np.int64]:
    return np.round(t_s * 1e9).astype(np.int64)


def _stored(readings: FloatArray, stream: StreamSpec, channels: tuple[ChannelSpec, ...]) -> npt.NDArray[np.generic]:
    dtype = np.dtype(stream.dtype)
    if dtype.kind == "f":
        return readings.astype(dtype)
    info = np.iinfo(dtype)
    if readings.size and (readings.min() < info.min or readings.max() > info.max):
        worst = channels[int(np.argmax(np.abs(readings).max(axis=0)))].name
        raise RigError(
            f"Channel {worst} of stream {stream.name} leaves the range of {stream.dtype}.",
            hint="State lower and upper in the channel's spec, or a wider dtype in the stream's.",
        )
    stored: npt.NDArray[np.generic] = np.rint(readings).astype(dtype)
    return stored

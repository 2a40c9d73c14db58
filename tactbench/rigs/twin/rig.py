"""The twin as a rig: opens a scene, applies its plan, hands out blocks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

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
    Source,
    StreamSpec,
    load_object,
)
from tactbench.rigs.twin.geometry import Contact, radius_mm
from tactbench.rigs.twin.planner import Plan, plan_scene
from tactbench.rigs.twin.synthesis import Synthesis

ROWS_PER_BLOCK = 1000
REFERENCE_STREAM = "force_torque"
_ONE_CLOCK = Source(
    tag="assumed",
    reference="the twin samples the sensor and the force sensor at once, on the scene's reference clock, as the "
    "embedded system of Karl et al. 2016 does (5000 samples in 60 s)",
)


@dataclass(frozen=True)
class TwinAcquisition:
    """One simulated recording: iterate it for blocks."""

    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    assumptions: Mapping[str, Scalar]
    drawn: Mapping[str, Scalar]
    t_ns: npt.NDArray[np.int64]
    """(n,) nanoseconds since the first sample."""
    samples: Mapping[str, tuple[npt.NDArray[np.generic], npt.NDArray[np.uint8] | None]] = field(repr=False)
    """Stream -> (n, channels) data and quality."""

    def __iter__(self) -> Iterator[Block]:
        """Yield blocks of up to 1000 rows, the streams in turn, as samples taken at once would arrive."""
        for start in range(0, self.t_ns.size, ROWS_PER_BLOCK):
            rows = slice(start, start + ROWS_PER_BLOCK)
            for stream in (*self.streams, *self.reference):
                data, quality = self.samples[stream.name]
                yield Block(
                    stream=stream.name,
                    t_ns=self.t_ns[rows],
                    data=data[rows],
                    quality=None if quality is None else quality[rows],
                )


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
    channels = tuple(channel for channel in sensor.spec.channels() if channel.kind in plan.kinds)
    t_s, force = _load(scene)
    rest = np.array([_rest(channel) for channel in channels])
    run = Synthesis(
        sensor=sensor,
        scene=scene,
        seed=seed,
        channels=channels,
        t_s=t_s,
        force_n=force,
        contact=Contact(radius_mm(scene.indenter), 0.0, 0.0),
        readings=np.tile(rest, (t_s.size, 1)),
        quality=np.zeros((t_s.size, len(channels)), dtype=np.uint8),
        reference_n=force.copy(),
        lent=dict(plan.lent),
    )
    run.contact = _place(run)
    return run


def _load(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Return times and true force: held at the start, then straight to the end."""
    profile = scene.profile
    duration, hold = profile.duration.to("s"), profile.hold.to("s")
    start, end = profile.start.to("N"), profile.end.to("N")
    stated = (duration, hold, start, end)
    if not all(map(math.isfinite, stated)) or not duration > 0 or hold < 0 or min(start, end) < 0:
        raise RigError(
            f"The scene {scene.name!r} asks for a ramp from {start:g} to {end:g} N within {duration:g} s after "
            f"{hold:g} s of rest.",
            hint="Duration must be positive, hold and forces at least zero, all of them finite.",
        )
    t_s: FloatArray = np.arange(profile.samples, dtype=np.float64) * (duration / profile.samples)
    if hold >= duration:
        return t_s, np.full(t_s.size, start)
    force: FloatArray = start + (end - start) * np.clip((t_s - hold) / (duration - hold), 0.0, 1.0)
    return t_s, force


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
    columns = {channel.name: column for column, channel in enumerate(run.channels)}
    streams: list[StreamSpec] = []
    samples: dict[str, tuple[npt.NDArray[np.generic], npt.NDArray[np.uint8] | None]] = {}
    for stream in run.sensor.spec.streams:
        kept = tuple(channel for channel in stream.channels if channel.name in columns)
        if not kept:
            continue
        own = [columns[channel.name] for channel in kept]
        streams.append(stream.model_copy(update={"channels": kept, "rate_hz": rate, "rate_source": _ONE_CLOCK}))
        samples[stream.name] = (_stored(run.readings[:, own], stream, kept), run.quality[:, own])
    reference = StreamSpec(
        name=REFERENCE_STREAM,
        rate_hz=rate,
        rate_source=_ONE_CLOCK,
        channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1),),
    )
    samples[REFERENCE_STREAM] = (run.reference_n[:, None], None)
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
        t_ns=np.round(run.t_s * 1e9).astype(np.int64),
        samples=samples,
    )


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

"""The twin as a rig: plans a scene, applies the plan's effects, yields samples."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from tactbench.plugin import (
    Block,
    ChannelSpec,
    EffectDescriptor,
    FloatArray,
    PlanEntry,
    RigContext,
    Scalar,
    Scene,
    SensorDescriptor,
    StreamSpec,
    load_object,
)
from tactbench.rigs.twin.effects.signal import Signal
from tactbench.rigs.twin.planner import Plan, plan

BLOCK_ROWS = 1000
REFERENCE = StreamSpec(
    name="force_torque",
    dtype="float64",
    channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1),),
)
"""The rig's force-torque sensor. One embedded system samples it and the sensor together (Karl et al. 2016, section
II-C), so both have the clock of the scene: 5000 samples in 60 s."""


def build(context: RigContext) -> Twin:
    """Return the twin with the effects that are installed."""
    return Twin(context.effects)


class Twin:
    """A simulated parallel manipulator with its sensors."""

    def __init__(self, effects: tuple[EffectDescriptor, ...]) -> None:
        self._effects = effects

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[TwinAcquisition]:
        """Simulate `scene`; the same `seed` gives the same samples, bit by bit.

        Raises
        ------
        NotApplicable
            If the sensor has no channel that the scene looks at.
        RigError
            If the sensor cannot be simulated, or the scene cannot be carried out on it.
        """
        chosen = plan(scene, sensor.spec, self._effects)
        t_s, force = _profile(scene)
        signal = Signal(sensor, scene, seed, chosen.channels, t_s, force)
        for effect in chosen.effects:
            load_object(effect.where)(signal)
        yield TwinAcquisition(signal, chosen)


@dataclass(frozen=True)
class TwinAcquisition:
    """A scene that has been simulated."""

    signal: Signal
    chosen: Plan

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The sensor's streams, with the observed channels only, all on the scene's clock."""
        seen = {channel.name for channel in self.chosen.channels}
        rate = len(self.signal.t_s) / self.signal.scene.profile.duration.to("s")
        streams = []
        for stream in self.signal.sensor.spec.streams:
            channels = tuple(channel for channel in stream.channels if channel.name in seen)
            if channels:
                streams.append(stream.model_copy(update={"channels": channels, "rate_hz": rate, "rate_source": None}))
        return tuple(streams)

    @property
    def reference(self) -> tuple[StreamSpec, ...]:
        """The force-torque sensor."""
        return (REFERENCE,)

    @property
    def plan(self) -> tuple[PlanEntry, ...]:
        """Effects included and left out, with reasons."""
        return self.chosen.entries

    @property
    def assumptions(self) -> dict[str, Scalar]:
        """The assumed parameters that decide the result."""
        scene = self.signal.scene
        return {
            "placement_scatter_mm": scene.placement.scatter.to("mm"),
            "drift_scale": scene.environment.drift_scale,
            "noise_scale": scene.environment.noise_scale,
            "session_offset_scale": scene.environment.session_offset_scale,
            "since_power_on_s": scene.environment.since_power_on.to("s"),
            "force_noise_n": scene.environment.force_noise.to("N"),
        }

    @property
    def drawn(self) -> dict[str, Scalar]:
        """What was drawn and achieved."""
        return self.signal.drawn

    def __iter__(self) -> Iterator[Block]:
        signal = self.signal
        t_ns = np.round(signal.t_s * 1e9).astype(np.int64)
        column = {channel.name: place for place, channel in enumerate(self.chosen.channels)}
        for start in range(0, len(t_ns), BLOCK_ROWS):
            rows = slice(start, start + BLOCK_ROWS)
            for stream in self.streams:
                places = [column[channel.name] for channel in stream.channels]
                data = signal.samples[rows, places].astype(stream.dtype)
                yield Block(stream.name, t_ns[rows], data, signal.quality[rows, places])
            yield Block(REFERENCE.name, t_ns[rows], signal.label[rows, None])


def _profile(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Return the times [s] and true forces [N] of the scene's samples: held, then a straight ramp."""
    profile = scene.profile
    duration, hold = profile.duration.to("s"), profile.hold.to("s")
    t_s = np.arange(profile.samples, dtype=np.float64) * (duration / profile.samples)
    share = np.clip((t_s - hold) / max(duration - hold, 1e-12), 0.0, 1.0)
    return t_s, profile.start.to("N") + share * (profile.end.to("N") - profile.start.to("N"))

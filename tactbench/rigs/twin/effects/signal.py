"""What effects work on: the quantities of one recording on its way from force to samples."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from tactbench.plugin import ChannelSpec, FloatArray, Nuisances, Scalar, Scene, SensorDescriptor

Scope = Literal["recording", "session", "unit"]
"""How long a random draw holds: for one recording, for one session, or for ever in one unit of the sensor."""


@dataclass
class Signal:
    """One recording in the making."""

    sensor: SensorDescriptor
    scene: Scene
    seed: int
    channels: tuple[ChannelSpec, ...]
    """The channels somebody looks at."""
    t_s: FloatArray
    """(n,) seconds from the first sample; need not be uniform."""
    force: FloatArray
    """(n,) true normal force [N]"""
    load: FloatArray = field(init=False)
    """(n,) force that the skin answers to; the true one unless it creeps"""
    response: FloatArray = field(init=False)
    """(n, channels) change of the noise-free reading from rest"""
    readings: FloatArray = field(init=False)
    """(n, channels) in the channels' unit, before the converter"""
    samples: FloatArray = field(init=False)
    """(n, channels) as the converter gives them"""
    quality: npt.NDArray[np.uint8] = field(init=False)
    label: FloatArray = field(init=False)
    """(n,) what the force-torque sensor says [N]"""
    drawn: dict[str, Scalar] = field(default_factory=dict)
    """What was drawn or achieved, for the recording."""

    def __post_init__(self) -> None:
        shape = (len(self.t_s), len(self.channels))
        self.load = self.force
        self.response = np.zeros(shape)
        self.readings = self.response
        self.samples = self.readings
        self.quality = np.zeros(shape, dtype=np.uint8)
        self.label = self.force

    def generator(self, effect: str, scope: Scope) -> np.random.Generator:
        """Return the generator of `effect`: leaving another effect out does not change what this one draws."""
        parts = [effect, self.sensor.name]
        if scope != "unit":
            parts.append(self.scene.session)
        if scope == "recording":
            parts.append(self.scene.name)
        words = hashlib.sha256("\0".join(parts).encode()).digest()
        entropy = [self.seed, *np.frombuffer(words[:16], dtype="<u4").tolist()]
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy)))

    def each(self, pick: Callable[[Nuisances], float]) -> FloatArray:
        """Return (channels,) of a nuisance; 0 for a channel whose kind states none."""
        known = self.sensor.spec.nuisances
        return np.array([pick(known[c.kind]) if c.kind in known else 0.0 for c in self.channels], dtype=np.float64)

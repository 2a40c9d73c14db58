"""Carrying out a tiny press on a simulated rig, for checks to look at what came of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from tactbench.core.conformance.check import code_of, skip
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import NotApplicable
from tactbench.core.plugins.registry import load_object
from tactbench.core.plugins.taking_part import rig_context
from tactbench.core.samples import Block
from tactbench.core.spec.profile import ForceRamp
from tactbench.core.spec.quantity import assumed
from tactbench.core.spec.recording import PlanEntry
from tactbench.core.spec.rig import RigDescriptor, SensorDescriptor
from tactbench.core.spec.scene import Environment, Scene, Simulation
from tactbench.core.spec.sensor import StreamSpec

if TYPE_CHECKING:
    import numpy.typing as npt

    from tactbench.core.samples import FloatArray

FORCE_N = 0.5
"""At the end of the press: every sensor that is touched by a hand bears it."""
SECONDS = 1.0
SAMPLES = 100
NOISE_N = 0.005
"""Of the reference force: a hundredth of the press, so that draws can be told apart and the force still be read."""
_WHY = "a check of plugins"


def tiny_scene(name: str = "tiny", **changes: Any) -> Scene:
    """Return a press of a second to half a newton, with everything else as scenes have it."""
    ramp = ForceRamp(
        end=assumed(FORCE_N, "N", _WHY), hold=assumed(SECONDS / 5, "s", _WHY), duration=assumed(SECONDS, "s", _WHY),
        samples=SAMPLES,
    )  # fmt: skip
    environment = Environment(force_noise=assumed(NOISE_N, "N", _WHY))
    return Scene(name=name, profile=ramp, environment=environment).model_copy(update=changes)


@dataclass(frozen=True)
class TrialPress:
    """What a rig gave for a scene."""

    scene: Scene
    sensor: SensorDescriptor
    rig: RigDescriptor
    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    said: Mapping[str, Mapping[str, Any]]
    """Its assumptions and what it has drawn."""
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

        own = [one for one in self.blocks if one.stream == stream]
        return np.concatenate(
            [np.zeros(np.shape(one.data), np.uint8) if one.quality is None else one.quality for one in own]
        )

    def t_ns(self, stream: str) -> npt.NDArray[Any] | None:
        """Return the (n,) times of a stream; None: it has no clock."""
        import numpy as np

        times = [one.t_ns for one in self.blocks if one.stream == stream]
        return None if any(one is None for one in times) else np.concatenate([one for one in times if one is not None])


def carried_out(rig: Any, descriptor: RigDescriptor, sensor: SensorDescriptor, scene: Scene, seed: int) -> TrialPress:
    """Carry out a scene on a rig that was built; raises what the rig raises."""
    with rig.open(sensor, scene, seed=seed) as acquisition:
        streams, reference = tuple(acquisition.streams), tuple(acquisition.reference)
        blocks = tuple(acquisition)
        said = {"assumptions": dict(acquisition.assumptions), "drawn": dict(acquisition.drawn)}
        plan = tuple(acquisition.plan)
    return TrialPress(scene, sensor, descriptor, streams, reference, plan, said, blocks)


def simulated_rig(subject: Subject) -> tuple[Any, RigDescriptor]:
    """Return the first simulated rig, built, those that come with this package before others."""
    owned = subject.registry.rigs.all_owned()
    simulated = sorted((one for one in owned if one.descriptor.simulated), key=lambda one: not one.ours)
    if not simulated:
        skip("no simulated rig is installed")
    descriptor = simulated[0].descriptor
    return load_object(descriptor.where)(rig_context(subject.registry)), descriptor


def simulated_sensors(subject: Subject) -> Sequence[SensorDescriptor]:
    """Return sensors that a simulation can press: of this package, the cheapest first, then of the plugin's own."""
    able = []
    for owned in subject.registry.sensors.all_owned():
        skin = owned.descriptor.spec.skin
        if skin is not None and owned.descriptor.transducer is not None:
            cost = len(owned.descriptor.spec.channels()) * math.prod(skin.sheet.cells)
            if owned.ours or owned.distribution == subject.distribution:
                able.append((not owned.ours, cost, owned.descriptor.name, owned.descriptor))
    return [one[-1] for one in sorted(able, key=lambda one: one[:3])]


@lru_cache(maxsize=6)
def pressed(subject: Subject, seed: int = 1) -> TrialPress:
    """Return the tiny press of a subject: of a sensor on a simulated rig, or of a rig on a sensor."""
    if subject.kind == "sensor":
        rig, descriptor = simulated_rig(subject)
        sensor, field = subject.descriptor, "spec"
    else:
        descriptor, field = subject.descriptor, "where"
        if not descriptor.simulated:
            skip("it moves something real: `--rig-file FILE` presses with it")
        if not simulated_sensors(subject):
            skip("no sensor that can be simulated is installed")
        sensor = simulated_sensors(subject)[0]
        with code_of("where", subject.package):
            rig = subject.code("where")(rig_context(subject.registry))
    kinds = tuple(dict.fromkeys(channel.kind for channel in sensor.spec.channels()))
    scene = tiny_scene(observe=("taxel",) if "taxel" in kinds else kinds)
    with code_of(field, subject.package):
        return carried_out(rig, descriptor, sensor, scene, seed)


def scenes_of(observe: tuple[str, ...]) -> Iterator[Scene]:
    """Yield tiny scenes of several kinds: pressed, under force control, warmer than the sensor, sliding."""
    from tactbench.core.spec.drive import ForceLoop
    from tactbench.core.spec.scene import Slide

    plain = tiny_scene(observe=observe)
    yield plain
    yield plain.model_copy(update={"drive": ForceLoop()})
    warm = plain.environment.model_copy(update={"indenter_temperature": assumed(40.0, "degC", _WHY)})
    yield plain.model_copy(update={"environment": warm})
    slide = Slide(speed=assumed(10.0, "mm/s", _WHY), start=assumed(SECONDS / 2, "s", _WHY))
    yield plain.model_copy(update={"slide": slide})


def first_that_goes(
    subject: Subject, scenes: Sequence[Scene], asked: str, where: str
) -> tuple[Any, RigDescriptor, SensorDescriptor, Scene, TrialPress] | None:
    """Return a rig, a sensor and a scene with which a simulation goes, and the press; None: none is applicable.

    `asked` is an effect that is included by name, with those of its distribution that give it what it consumes as
    candidates; "" for none.
    """
    rig, descriptor = simulated_rig(subject)
    words = (*_giving_to(subject), f"+{asked}") if asked else ()
    for scene in scenes:
        if words:
            scene = scene.model_copy(update={"simulation": Simulation(effects=words)})
        for sensor in simulated_sensors(subject):
            try:
                with code_of(where, subject.package):
                    made = carried_out(rig, descriptor, sensor, scene, 1)
            except AssertionError as error:
                if isinstance(error.__cause__, NotApplicable):
                    continue
                raise
            return rig, descriptor, sensor, scene, made
    return None


def _giving_to(subject: Subject) -> list[str]:
    """Return the effects of an effect's own distribution that produce what it consumes."""
    siblings = [one for one in subject.registry.effects.all_owned() if one.distribution == subject.distribution]
    consumed = set(subject.descriptor.consumes)
    return [one.descriptor.name for one in siblings if consumed.intersection(one.descriptor.produces)]

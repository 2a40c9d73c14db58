"""The simulated rig: applies the effects in a scene's plan and yields the samples as blocks."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from tactbench.plugin import (
    Block,
    ChannelSpec,
    FloatArray,
    IndenterDescriptor,
    NotApplicable,
    PlanEntry,
    Quality,
    RigContext,
    RigError,
    Scalar,
    Scene,
    SensorDescriptor,
    SensorSpec,
    Source,
    StreamSpec,
)
from tactbench.plugin.simulation import EffectDescriptor, Explained, effect_names
from tactbench.rigs.twin.contact.stages import bare_skin, forget_tables
from tactbench.rigs.twin.geometry import shape_of
from tactbench.rigs.twin.planner import Plan, carried_out, commanded_place_mm, handled, plan_scene
from tactbench.rigs.twin.synthesis import Synthesis

_CURVE_POINTS = 4001
"""Number of points of a force-depth curve; between them, linear interpolation errs by less than 1e-4 of the largest."""
REFERENCE_STREAM = "force_torque"
_PLACE_CHANNELS = tuple(ChannelSpec(name=name, kind="position", unit="m") for name in ("x", "y"))
"""Channels of the contact's place on the unrolled skin: ``x`` along the finger towards the tip, ``y`` along its arc."""
_ONE_CLOCK = Source(
    tag="assumed",
    reference="the twin samples the sensor and the force sensor at once, on the scene's reference clock, as the "
    "embedded system of Karl et al. 2016 does (5000 samples in 60 s)",
)


@dataclass(frozen=True)
class TwinAcquisition:
    """One simulated recording; iterating over it yields its blocks of samples."""

    streams: tuple[StreamSpec, ...]
    reference: tuple[StreamSpec, ...]
    plan: tuple[PlanEntry, ...]
    assumptions: Mapping[str, Scalar]
    drawn: Mapping[str, Scalar]
    samples: Mapping[str, Block] = field(repr=False)
    """Blocks of samples by the name of their stream, the sensor's streams first."""
    run: Synthesis = field(repr=False)

    def press_curve(self, largest_n: float) -> tuple[FloatArray, FloatArray]:
        """Return depths (n,) [m] and normal forces (n,) [N] of the indenter up to `largest_n`; see SimulatedPress."""
        table = bare_skin(self.run, largest_n)
        forces_n: FloatArray = np.linspace(0.0, largest_n, _CURVE_POINTS)
        # Ties and dips by rounding would leave a depth without its force.
        depths_mm = np.maximum.accumulate(table.skin(forces_n).depth_mm)
        return 1e-3 * (depths_mm - depths_mm[0]), forces_n

    def __iter__(self) -> Iterator[Block]:
        """Return an iterator over the blocks of samples, one block for each stream."""
        return iter(self.samples.values())


class Twin:
    """The simulated rig, with the given effects and all installed shapes of indenters.

    `effects` are candidates for every scene: a plan includes those that the scene needs. `named_effects` are candidates
    only if the sensor or the scene names them.
    """

    def __init__(
        self,
        effects: Sequence[EffectDescriptor],
        indenters: Sequence[IndenterDescriptor] = (),
        named_effects: Sequence[EffectDescriptor] = (),
    ) -> None:
        self.effects = tuple(effects)
        self.named_effects = tuple(named_effects)
        self.indenters = tuple(indenters)

    def _candidates(self, sensor: SensorDescriptor, scene: Scene) -> Sequence[EffectDescriptor]:
        names = effect_names(sensor, scene)
        found = (*self.effects, *(effect for effect in self.named_effects if effect.name in names))
        missing = set(sensor.effects).difference(effect.name for effect in found)
        if missing:
            raise NotApplicable(
                f"{sensor.name} is simulated with the effects {', '.join(sorted(missing))}, which are not installed.",
                hint="Install the package that provides these effects.",
            )
        return found

    def plan(self, sensor: SensorDescriptor, scene: Scene) -> Plan:
        """Return the plan of a scene without simulating the scene.

        Entries that can be decided only after the contact is solved (the core) are provisional until ``open``.
        """
        if sensor.spec.skin is None or sensor.transducer is None:
            missing = "skin" if sensor.spec.skin is None else "transducer"
            raise NotApplicable(
                f"{sensor.name} declares no {missing}: it can be recorded or replayed, not simulated.",
                hint="Declare a skin and a transducer in the sensor's plugin.",
            )
        shape_of(scene.indenter, self.indenters)  # what no rung could press is refused before anything is made
        return plan_scene(self._candidates(sensor, scene), scene, handled(sensor, scene).spec)

    @contextmanager
    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> Iterator[TwinAcquisition]:
        """Simulate `scene` with `sensor` and yield the recording; the same seed gives the same bits.

        Raises
        ------
        NotApplicable
            If the twin does not model the sensor or an observed kind of channel.
        RigError
            If the contact cannot be resolved or solved.
        """
        plan = self.plan(sensor, scene)
        yield _acquisition(carried_out(sensor, scene, seed, plan, indenters=self.indenters), plan)

    def explain(self, sensor: SensorDescriptor, scene: Scene, *, rounds: int = 0) -> Sequence[Explained]:
        """Return the plan of a scene with the cost of each effect on this machine; see Explaining."""
        plan = self.plan(sensor, scene)
        if not rounds:
            return [Explained(entry, None) for entry in plan.entries]
        runs = []
        for _ in range(rounds + 1):
            forget_tables()
            runs.append(carried_out(sensor, scene, 1, plan, indenters=self.indenters))
        del runs[0]  # its times include imports
        forget_tables()  # the next recording of the scene solves its contact itself
        return [
            Explained(entry, None, "part of the contact" if entry.included else "")
            if not entry.included or entry.effect in plan.lent
            else Explained(entry, statistics.median(run.spent_s[entry.effect] for run in runs))
            for entry in plan.settled(runs[-1].settled)
        ]


def build(context: RigContext) -> Twin:
    """Return the twin with the installed effects and indenters."""
    return Twin(context.effects, indenters=context.indenters, named_effects=context.named_effects)


def _acquisition(run: Synthesis, plan: Plan) -> TwinAcquisition:
    profile = run.scene.profile
    rate = profile.samples / profile.duration.to("s")
    streams: list[StreamSpec] = []
    blocks: list[Block] = []
    for track in run.tracks:
        clock, end = {} if track.clock else {"rate_hz": rate, "rate_source": _ONE_CLOCK}, 0
        for stream in track.streams:
            own = slice(end, end + len(stream.channels))
            end = own.stop
            streams.append(stream.model_copy(update=clock))
            stored = _stored(track.readings[:, own], stream)
            blocks.append(Block(stream.name, _ns(track.t_s), stored, track.quality[:, own]))
    more = {**run.reference_more, **_along_the_slide(run)}
    reference = StreamSpec(
        name=REFERENCE_STREAM,
        rate_hz=rate,
        rate_source=_ONE_CLOCK,
        channels=(ChannelSpec(name="fz", kind="force", unit="N", sign=1), *(channel for channel, _ in more.values())),
    )
    measured = np.column_stack([run.reference_n, *(values for _, values in more.values())])
    blocks.append(Block(REFERENCE_STREAM, _ns(run.t_s), measured))
    places: tuple[StreamSpec, ...] = ()
    if "position" in run.scene.observe:
        place, block = _contact_point(run, rate)
        blocks.append(block)
        places = (place,)
    contact_x, contact_s = commanded_place_mm(run.sensor.spec, run.scene)
    shape = run.contact.shape
    return TwinAcquisition(
        streams=tuple(streams),
        reference=(reference, *places),
        plan=plan.settled(run.settled),
        assumptions={
            "contact_x_mm": contact_x,
            "contact_s_mm": contact_s,
            # A scene may leave the dimensions of a shape to the shape itself.
            **{f"indenter {name}": size for name, size in (() if shape is None else shape.sizes)},
            **_stated(run.scene, run.sensor.spec),
            **_simulated_as(run.scene),
        },
        drawn=dict(run.drawn),
        samples={block.stream: block for block in blocks},
        run=run,
    )


def _contact_point(run: Synthesis, rate_hz: float) -> tuple[StreamSpec, Block]:
    """Return the stream of the apex of the indenter on the skin, and its (n, 2) samples [m].

    There are no samples for times without contact.

    Raises
    ------
    NotApplicable
        If the indenter slides: the twin computes the pressure only at the place of the first contact.
    """
    if run.scene.slide is not None:
        raise NotApplicable(
            "The twin does not move the contact over the skin, so it cannot record the place of a sliding indenter.",
            hint="Remove `slide` from the scene, or `position` from its observed channels.",
        )
    place_m = 1e-3 * np.array([run.contact.x_mm, run.contact.s_mm])
    quality = np.where(run.load.at(run.t_s) > 0, Quality.GOOD, Quality.MISSING).astype(np.uint8)
    stream = StreamSpec(name="contact_point", rate_hz=rate_hz, rate_source=_ONE_CLOCK, channels=_PLACE_CHANNELS)
    values = np.tile(place_m, (run.t_s.size, 1))
    return stream, Block(stream.name, _ns(run.t_s), values, np.column_stack([quality, quality]))


def _along_the_slide(run: Synthesis) -> dict[str, tuple[ChannelSpec, FloatArray]]:
    """Return the measured normal force and the force along a slide, by name; an empty dict without a slide."""
    if run.scene.slide is None or "fx" not in run.reference_more:
        return {}
    angle = run.scene.slide.direction.to("rad")
    along = math.cos(angle) * run.reference_more["fx"][1] + math.sin(angle) * run.reference_more["fy"][1]
    return {
        "normal": (ChannelSpec(name="normal", kind="force", unit="N", sign=1), run.reference_n),
        "tangential": (ChannelSpec(name="tangential", kind="force", unit="N"), along),
    }


_STATED = frozenset({
    "placement_scatter_mm", "drift_scale", "noise_scale", "offset_scale", "session_offset_scale", "since_power_on_s",
    "force_noise_n", "force_filter_hz", "indenter_temperature_degc", "drive_proportional_mm_per_n",
    "drive_integral_mm_per_n_s", "drive_cutoff_hz", "drive_delay_ms", "surface_static_friction",
    "surface_kinetic_friction", "surface_roughness_um",
})  # fmt: skip
"""Nuisances that every recording states; other nuisances are stated only if they were set for the run."""


def _stated(scene: Scene, sensor: SensorSpec) -> dict[str, Scalar]:
    """Return the most important nuisances of the scene, those that were set for the run, and the slide."""
    own = dict(scene.simulation.nuisances)
    kept = _STATED | own.keys() | ({"ambient_degc"} if scene.environment.indenter_temperature is not None else set())
    stated: dict[str, Scalar] = {name: value for name, value in scene.nuisances().items() if name in kept}
    stated |= {name: amount.value for name, amount in sensor.settable().items() if name in own}
    if scene.drive is not None and scene.drive.cutoff is None:
        stated["drive_cutoff_hz"] = "none"
    if scene.slide is not None:
        stated["slide_mm_s"] = scene.slide.speed.to("mm/s")
    return stated


def _simulated_as(scene: Scene) -> dict[str, Scalar]:
    """Return the scene's simulation settings that differ from the defaults; they are printed with every result row."""
    own = scene.simulation
    found = {
        "effects": " ".join(own.effects) or None, "rung": own.rung, "tolerance_count": own.tolerance,
        "scenario": own.scenario,
    }  # fmt: skip
    return {name: value for name, value in found.items() if value is not None}


def _ns(t_s: FloatArray) -> npt.NDArray[np.int64]:
    return np.round(t_s * 1e9).astype(np.int64)


def _stored(readings: FloatArray, stream: StreamSpec) -> npt.NDArray[np.generic]:
    dtype = np.dtype(stream.dtype)
    if dtype.kind == "f":
        return readings.astype(dtype)
    info = np.iinfo(dtype)
    if readings.size and (readings.min() < info.min or readings.max() > info.max):
        worst = stream.channels[int(np.argmax(np.abs(readings).max(axis=0)))].name
        raise RigError(
            f"Channel {worst} of stream {stream.name} leaves the range of {stream.dtype}.",
            hint="State lower and upper in the channel's spec, or a wider dtype in the stream's.",
        )
    return np.rint(readings).astype(dtype)

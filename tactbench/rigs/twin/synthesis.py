"""State of a simulated recording, which the effects of its plan read and change, and the accuracy of its contact."""

from __future__ import annotations

import dataclasses
import hashlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from tactbench.plugin import (
    ChannelKind,
    ChannelSpec,
    FloatArray,
    Scalar,
    Scene,
    SensorDescriptor,
    StreamSpec,
    UsageError,
    load_object,
)
from tactbench.plugin.simulation import EffectDescriptor, EffectRun, Nuisances, Skin, SkinSheet
from tactbench.rigs.twin.geometry import Contact


@dataclass(frozen=True)
class Fidelity:
    """A set of accuracy settings; they change the error of the solution, not the model."""

    solver: Literal["newton", "local"] = "newton"
    """Contact solver: minimises the energy of the whole skin (newton), or computes each cell by itself (local)."""
    cells_factor: float = 1.0
    """Number of the skin's cells along each axis, relative to the number in the sensor's SkinSheet."""
    newton_tolerance: float = 1e-6
    """Largest relative residual of the contact solver."""
    most_nodes: int = 14
    """Largest number of loads at which a load table is solved."""
    table_tolerance_factor: float = 6.0
    """Wanted bound of a load table's interpolation error, as a multiple of the noise and rounding (rms).

    The bound is cautious: three times the interpolation error found at nodes. For a factor of 6 the actual error is
    0.1 of the noise (rms), and up to 3 times the noise just above touch-down.
    """

    def cells(self, sheet: SkinSheet) -> tuple[int, int]:
        """Return the numbers of the skin's cells along x and s: the sheet's times the factor, rounded to even numbers.

        Numbers are even because a half-complex transform of an odd grid has no Nyquist wave, needed to interpolate.
        """
        if self.cells_factor == 1.0:
            return sheet.cells
        along, across = (max(4, 2 * round(cells * self.cells_factor / 2)) for cells in sheet.cells)
        return along, across


DEFAULT = Fidelity()
"""Accuracy settings of every recording whose scene states no others."""
FINE = Fidelity(cells_factor=3.0, newton_tolerance=1e-8, most_nodes=64, table_tolerance_factor=0.1)
"""Reference settings, with which the error of other settings is measured, at a hundred times the computing time."""

RUNGS: dict[str, Fidelity] = {
    "closed-form": dataclasses.replace(DEFAULT, solver="local"),
    "default": DEFAULT,
    "fine": dataclasses.replace(DEFAULT, cells_factor=2.0, most_nodes=32, table_tolerance_factor=1 / 3),
    "reference": FINE,
}
"""Accuracy settings of the contact solvers by name, the cheapest first."""


def rung(name: str) -> Fidelity:
    """Return the settings of the contact solver `name`; raises UsageError for an unknown name."""
    if name not in RUNGS:
        raise UsageError(f"The twin has no contact solver {name!r}.", hint=f"Set rung to one of: {', '.join(RUNGS)}.")
    return RUNGS[name]


def generator(seed: int, *scope: str) -> np.random.Generator:
    """Return the random number generator of one scope, for example ``(sensor, "unit", "gain")``.

    The scope's text is hashed (BLAKE2), so that the same seed and names give the same draws in every process and on
    every machine, and a new effect does not shift the draws of the others.
    """
    digest = hashlib.blake2b("\x1f".join(scope).encode(), digest_size=16).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
    # A negative seed is as good as any: SeedSequence wants its words unsigned.
    return np.random.default_rng(np.random.SeedSequence([seed % 2**64, *words]))


@dataclass(frozen=True)
class Load:
    """A normal force over time: linear between its knots, constant before the first and after the last."""

    t_s: FloatArray
    """(k,) ascending seconds since the recording's first sample."""
    force_n: FloatArray
    """(k,) normal force at these times."""

    def at(self, t_s: FloatArray) -> FloatArray:
        """Return the (n,) normal force at (n,) seconds since the recording's first sample."""
        return np.interp(t_s, self.t_s, self.force_n)

    @property
    def largest_n(self) -> float:
        """Largest normal force of the recording."""
        return float(self.force_n.max())


class Tangential(NamedTuple):
    """The tangential state of the contact at (n,) moments, in the direction of the slide."""

    force_n: FloatArray
    """Tangential force between surface and skin, as measured by a force sensor behind the surface."""
    displacement_mm: FloatArray
    """Tangential displacement of the skin under the contact relative to the core."""
    slip_mm_s: FloatArray
    """Speed of the surface relative to the skin under it; 0 while both stick together."""
    slip_mm: FloatArray
    """Distance that the surface has slipped over the skin."""
    slipping: npt.NDArray[np.bool_]
    """True while the whole contact slips."""
    stick_ratio: FloatArray
    """Radius of the sticking inner part of the contact divided by the contact's radius, 0 to 1."""


class Settled(NamedTuple):
    """Decision, made after the contact is solved, to include an effect in the plan or leave it out."""

    included: bool
    reason: str
    change: float | None = 0.0
    """Change of an observed channel if the effect is left out [unit of the plan's entry]: an upper bound for effects
    left out, an estimate for included effects; None: not known."""


@dataclass
class Track:
    """Channels of a sensor that share one clock, with their samples."""

    clock: str
    """Name of the stream that has this clock for itself; empty for the scene's reference clock."""
    streams: tuple[StreamSpec, ...]
    """The sensor's streams on this clock, limited to the recorded channels."""
    channels: tuple[ChannelSpec, ...]
    """Recorded channels of all streams on this clock, in order."""
    t_s: FloatArray
    """(n,) seconds since the recording's first sample."""
    force_n: FloatArray
    """(n,) true normal force at this clock's samples."""
    readings: FloatArray
    """(n, channels) readings, which effects change; before the first effect they are the rest levels."""
    quality: npt.NDArray[np.uint8]
    """(n, channels) quality flags of the readings."""
    effective_n: dict[ChannelKind, FloatArray] = field(default_factory=dict)
    """Kind of channel -> (n,) force that its readings follow, if it differs from the true normal force."""
    vibration_mm: FloatArray | None = None
    """(n,) vibration of the skin along its normal; None if the skin does not vibrate."""
    gain: FloatArray | None = None
    """(channels,) factors on the change of the readings from rest; None: all factors are 1."""
    warmth_k: FloatArray | None = None
    """(n,) kelvin by which the contact has warmed the core; None: no heat flows through it."""

    def by_kind(self) -> dict[ChannelKind, list[int]]:
        """Return the column numbers of each kind of channel in `readings`."""
        columns: dict[ChannelKind, list[int]] = {}
        for column, channel in enumerate(self.channels):
            columns.setdefault(channel.kind, []).append(column)
        return columns

    @property
    def scope(self) -> tuple[str, ...]:
        """Scope of the random draws on this clock; draws on other clocks are independent."""
        return (self.clock,) if self.clock else ()


@dataclass
class Synthesis:
    """State of one recording while its effects are applied.

    An effect is a callable that takes this object and changes it; the field ``where`` of its descriptor names it.
    """

    sensor: SensorDescriptor
    scene: Scene
    seed: int
    t_s: FloatArray
    """(n,) the reference clock: seconds since the recording's first sample."""
    load: Load
    """The true normal force over time; change it by :meth:`follow`."""
    tracks: tuple[Track, ...]
    """The sensor's channels, grouped by clock."""
    contact: Contact
    reference_n: FloatArray
    """(n,) reading of the force sensor; equal to the true force until an effect changes it."""
    reference_more: dict[str, tuple[ChannelSpec, FloatArray]] = field(default_factory=dict)
    """Further channels of the force sensor's stream, by name: (n,) on the reference clock."""
    sliding: Callable[[FloatArray], Tangential] | None = None
    """Function from (n,) seconds to the tangential state; None if nothing slides."""
    lent: frozenset[str] = frozenset()
    """Names of the effects that the contact solver applies."""
    settled: dict[str, Settled] = field(default_factory=dict)
    """Plan entries that were decided after the contact was solved, by name."""
    forced: frozenset[str] = frozenset()
    """Effects that the scene includes by name; they are applied even if they change no reading."""
    fidelity: Fidelity = DEFAULT
    """Accuracy settings of the contact solver."""
    rung: str = ""
    """Name of the contact solver that was chosen to keep the scene's tolerance."""
    rung_error: float | None = None
    """Estimated error of the chosen contact solver in the worst observed channel [its unit]; None: not estimated."""
    drawn: dict[str, Scalar] = field(default_factory=dict)
    """Random draws and achieved accuracies, by name, that are stored with the recording."""
    spent_s: dict[str, float] = field(default_factory=dict)
    """Seconds spent on each applied effect."""

    def apply(self, effect: EffectDescriptor) -> None:
        """Apply one effect to this recording, and keep the seconds it takes in `spent_s`."""
        began = time.perf_counter()
        load_object(effect.where)(self)
        self.spent_s[effect.name] = time.perf_counter() - began

    def follow(self, load: Load) -> None:
        """Set the true normal force to `load`, on every clock and for the force sensor."""
        self.load = load
        self.reference_n = load.at(self.t_s)
        for track in self.tracks:
            track.force_n = load.at(track.t_s)

    @property
    def skin(self) -> Skin:
        """The sensor's skin, which every simulated sensor has."""
        assert self.sensor.spec.skin is not None
        return self.sensor.spec.skin

    def columns(self, kind: ChannelKind) -> Iterator[tuple[Track, int]]:
        """Yield the recorded channels of a kind: their track, and their column in its readings."""
        for track in self.tracks:
            for column in track.by_kind().get(kind, []):
                yield track, column

    def nuisances(self, kind: ChannelKind) -> Nuisances | None:
        """Return the nuisances of a kind of channel; None when the spec states none."""
        return self.sensor.spec.nuisances.get(kind)

    def of_unit(self, *what: str) -> np.random.Generator:
        """Return the random generator for properties of this sensor unit, equal in all its recordings under a seed."""
        scope = "unit" if self.scene.first_unit else f"unit {self.scene.unit}"
        return generator(self.seed, self.sensor.name, scope, *what)

    def of_session(self, *what: str) -> np.random.Generator:
        """Return the random generator for properties that are equal in all recordings of a session."""
        return generator(self.seed, self.sensor.name, "session", self.scene.session, *what)

    def of_recording(self, *what: str) -> np.random.Generator:
        """Return the random generator for properties of this recording alone."""
        return generator(self.seed, self.sensor.name, "recording", self.scene.session, self.scene.name, *what)

    def of_every_channel(self, track: Track, kind: ChannelKind, generator: np.random.Generator) -> FloatArray:
        """Return one standard normal number for each recorded channel of `kind` in `track`.

        Numbers are drawn for all the sensor's channels of this kind: they do not depend on which are recorded.
        """
        every = [channel.name for channel in self.sensor.spec.channels(kind)]
        numbers = dict(zip(every, generator.standard_normal(len(every)), strict=True))
        return np.array([numbers[channel.name] for channel in track.channels if channel.kind == kind])


if TYPE_CHECKING:
    # Effects of others are written against this interface.
    _of_others: type[EffectRun] = Synthesis

"""The nouns that walk: everything that passes from rig to leaderboard.

``Block`` (from a rig) → ``StreamData`` (in a recording) → ``Table`` (one recording on one clock) → ``Part`` (X and y
of one role) → ``Fold`` → predictions → score.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntFlag
from typing import TYPE_CHECKING, Any

from tactbench.core.spec.sensor import StreamSpec

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]
    """An array of float64 of any shape."""
    IntArray = npt.NDArray[np.int64]


def __getattr__(name: str) -> Any:
    """Import numpy for the aliases when somebody asks for one: listings and cached runs do without."""
    if name not in ("FloatArray", "IntArray"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import numpy as np
    import numpy.typing as npt

    found = {"FloatArray": npt.NDArray[np.float64], "IntArray": npt.NDArray[np.int64]}
    globals().update(found)
    return found[name]


class Quality(IntFlag):
    """What is wrong with one sample of one channel; 0 is a good sample."""

    GOOD = 0
    MISSING = 1
    """No sample: the stored number means nothing."""
    SATURATED = 2
    """The converter stood at its end."""
    SUSPECT = 4
    """Parity, checksum or sequence error."""
    GAP = 8
    """The sample is good, but rows before it were lost: on the way here, or between reading and writing."""


@dataclass(frozen=True)
class Block:
    """A stretch of samples of one stream, as a rig yields it."""

    stream: str
    t_ns: IntArray | None
    """(n,) nanoseconds; None when there is no clock. Where the device has a clock of its own: when the host had the
    sample."""
    data: npt.NDArray[Any]
    """(n, channels), in the units of the stream's channels."""
    quality: npt.NDArray[np.uint8] | None = None
    """(n, channels) of :class:`Quality`; None: all good."""
    sequence: IntArray | None = None
    """(n,) the device's own number of each sample, if it has one, counted on over its wraps."""
    device_ns: IntArray | None = None
    """(n,) nanoseconds of the device's own clock, if it has one, counted on over its wraps. Where the count is lost, it
    begins again with a lower number: that is how a break is told."""

    def rows(self, which: slice | npt.NDArray[np.bool_]) -> Block:
        """Return some of its rows, by a slice or a mask."""
        return replace(self, **{name: one[which] for name in COLUMNS if (one := getattr(self, name)) is not None})


COLUMNS = ("t_ns", "data", "quality", "sequence", "device_ns")
"""Of a block."""


def join_blocks(blocks: Sequence[Block]) -> Block:
    """Return blocks of one stream as one; raises ValueError if their columns do not fit each other."""
    import numpy as np

    given = [name for name in COLUMNS if getattr(blocks[0], name) is not None]
    whole: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in blocks]) for name in given}
    return replace(blocks[0], **whole)


@dataclass(frozen=True)
class StreamData:
    """A stream read back from a recording."""

    spec: StreamSpec
    t_ns: IntArray | None
    """(n,) nanoseconds, or None when the source has no clock; on the host's clock where there are several."""
    data: npt.NDArray[Any]
    """(n, channels)"""
    quality: npt.NDArray[np.uint8] | None
    annotations: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    """Row labels: name -> (n,) of str or int."""
    sequence: IntArray | None = None
    """(n,) the device's own numbers, if it has any."""
    device_ns: IntArray | None = None
    """(n,) nanoseconds of the device's own clock, if it has one."""
    host_ns: IntArray | None = None
    """(n,) when the host had the samples, where `t_ns` was computed from `device_ns`."""


@dataclass(frozen=True)
class StreamReadings:
    """One stream of one recording on the stream's own clock: what features of a whole recording are made of."""

    stream: str
    channels: tuple[str, ...]
    kinds: tuple[str, ...]
    """of each channel"""
    data: FloatArray
    """(n, channels); rows in which a channel has no sample are not in it"""
    time_s: FloatArray | None
    """(n,) seconds since the first sample that the protocol keeps; None where the recording has no clock"""
    rate_hz: float | None
    """one over the median step of the clock, or else as stated; None where neither is known"""


@dataclass(frozen=True)
class SkinGrid:
    """Cell centres of the unrolled skin, millimetres."""

    x_mm: FloatArray
    """(nx,) axial"""
    s_mm: FloatArray
    """(ns,) along the arc"""

    @property
    def cell_mm(self) -> tuple[float, float]:
        """Spacing in x and s."""
        return (
            float(self.x_mm[1] - self.x_mm[0]),
            float(self.s_mm[1] - self.s_mm[0]),
        )


@dataclass(frozen=True)
class SkinState:
    """The skin under one load: what a transducer may look at. Units mm, N, MPa."""

    grid: SkinGrid
    force_n: float
    deflection_mm: FloatArray
    """(nx, ns), positive towards the core."""
    pressure_mpa: FloatArray
    """(nx, ns) contact pressure."""
    thickness_mm: FloatArray
    """(nx, ns) film or foam thickness that is left."""
    depth_mm: float
    """Approach of the indenter since first touch."""
    fluid_pressure_mpa: float
    """Rise over rest; 0 for media without fluid."""
    contact_radius_mm: float
    """sqrt(5/2 <r²>) weighted with the contact pressure (exact for Hertz)."""
    residual: float
    """Relative residual of the solver."""
    tangential_displacement_mm: FloatArray | None = None
    """(2, nx, ns) how far the outer surface has moved along itself: [0] along x, [1] along s, each positive the way its
    coordinate grows; without friction what the press squeezes aside, under a slide what that drags along as well.
    None: the sensor's spec does not say that its transducer looks at it (`reads_shear`)."""
    shear_mpa: FloatArray | None = None
    """(2, nx, ns) shear traction of the indenter on the outer surface, in the same order: positive where it pulls the
    skin the way the coordinate grows. Its sum over cells times their area is the tangential force on the sensor. Zero
    while nothing slides: contacts are pressed without friction. None: as above."""


@dataclass(frozen=True)
class Part:
    """Rows of one role, ready for an estimator."""

    X: FloatArray
    """(n, features)"""
    y: npt.NDArray[Any]
    """(n,) numbers, (n, components) vectors, or class indices 0 … n_classes-1"""
    time_s: FloatArray
    """(n,) seconds since the recording's first sample (row index when there is no clock)"""
    recording: IntArray
    """(n,) which recording of the dataset the row is from"""
    row: IntArray
    """(n,) which row of that recording"""

    def __len__(self) -> int:
        return len(self.y)


@dataclass(frozen=True)
class Fold:
    """One training and one test set, with validation data where the protocol has any."""

    name: str
    train: Part
    test: Part
    validation: Part | None = None


@dataclass(frozen=True)
class Answers:
    """What an estimator said about the rows of one role, beside the truth."""

    y_true: npt.NDArray[Any]
    """(n,) numbers, (n, components) vectors, or class indices"""
    y_pred: npt.NDArray[Any]
    """of the same shape"""
    recording: IntArray
    """(n,) which recording of the cell the row is from"""
    row: IntArray
    """(n,) which row of that recording"""
    fold: IntArray
    """(n,) fold in which the row was answered"""
    time_s: FloatArray
    """(n,) seconds since the recording's first sample (row index when there is no clock)"""
    force_n: FloatArray
    """(n,) reference force as recorded; NaN where there is none"""

    def __len__(self) -> int:
        return len(self.y_true)

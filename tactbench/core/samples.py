"""Types of the data that pass from rig to leaderboard.

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
else:
    FloatArray = IntArray = Any  # listings and cached runs import no numpy


class Quality(IntFlag):
    """Marks of one sample of one channel; 0 is a good sample."""

    GOOD = 0
    MISSING = 1
    """There is no sample: the stored number means nothing."""
    SATURATED = 2
    """The converter was at its end."""
    SUSPECT = 4
    """There was an error of parity, checksum or sequence."""
    GAP = 8
    """The sample is good, but rows before it were lost: on the way here, or between reading and writing."""


@dataclass(frozen=True)
class Block:
    """A stretch of samples of one stream, as a rig yields it."""

    stream: str
    t_ns: IntArray | None
    """Times, (n,) nanoseconds: of a device with a clock of its own, when the host had the samples; None: no clock."""
    data: npt.NDArray[Any]
    """Samples, (n, channels), in the units of the stream's channels."""
    quality: npt.NDArray[np.uint8] | None = None
    """Marks of the samples, (n, channels) of :class:`Quality`; None: all are good."""
    sequence: IntArray | None = None
    """The device's own number of each sample, (n,), counted on over its wraps; None: it has none."""
    device_ns: IntArray | None = None
    """Times of the device's own clock, (n,) nanoseconds, counted on over its wraps; None: it has none. They go back
    where the count is lost."""

    def rows(self, which: slice | npt.NDArray[np.bool_]) -> Block:
        """Return the rows of a slice or a mask."""
        return replace(self, **{name: one[which] for name in COLUMNS if (one := getattr(self, name)) is not None})


COLUMNS = ("t_ns", "data", "quality", "sequence", "device_ns")
"""Names of the columns of a block."""


def join_blocks(blocks: Sequence[Block]) -> Block:
    """Return blocks of one stream as one; raises ValueError if their columns do not fit each other."""
    import numpy as np

    given = [name for name in COLUMNS if getattr(blocks[0], name) is not None]
    whole: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in blocks]) for name in given}
    return replace(blocks[0], **whole)


@dataclass(frozen=True)
class StreamData:
    """A stream that was read from a recording."""

    spec: StreamSpec
    t_ns: IntArray | None
    """Times, (n,) nanoseconds, on the host's clock where there are several; None when the source has no clock."""
    data: npt.NDArray[Any]
    """Samples, (n, channels), in the units of the stream's channels."""
    quality: npt.NDArray[np.uint8] | None
    annotations: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    """Labels of the rows by name, (n,) of str or int."""
    sequence: IntArray | None = None
    """The device's own numbers of the samples, (n,); None: it has none."""
    device_ns: IntArray | None = None
    """Times of the device's own clock, (n,) nanoseconds; None: it has none."""
    host_ns: IntArray | None = None
    """Times at which the host had the samples, (n,), where `t_ns` was computed from `device_ns`."""


@dataclass(frozen=True)
class StreamReadings:
    """One stream of a recording on its own clock, from which features of a whole recording are made."""

    stream: str
    channels: tuple[str, ...]
    kinds: tuple[str, ...]
    """Kind of each channel."""
    data: FloatArray
    """Samples, (n, channels), without rows in which a channel has none."""
    time_s: FloatArray | None
    """Times, (n,) seconds since the first sample that the protocol keeps; None where there is no clock."""
    rate_hz: float | None
    """Rate by the median step of the clock, or else as stated [Hz]; None where neither is known."""


@dataclass(frozen=True)
class SkinGrid:
    """Centres of the cells of the unrolled skin."""

    x_mm: FloatArray
    """Axial coordinates, (nx,)."""
    s_mm: FloatArray
    """Coordinates along the arc, (ns,)."""

    @property
    def cell_mm(self) -> tuple[float, float]:
        """Spacing of the centres in x and s."""
        return float(self.x_mm[1] - self.x_mm[0]), float(self.s_mm[1] - self.s_mm[0])


@dataclass(frozen=True)
class SkinState:
    """The skin under one load, which a transducer turns into readings; units are mm, N and MPa."""

    grid: SkinGrid
    force_n: float
    deflection_mm: FloatArray
    """Deflection of the skin, (nx, ns), positive towards the core."""
    pressure_mpa: FloatArray
    """Contact pressure, (nx, ns)."""
    thickness_mm: FloatArray
    """Remaining thickness of the film or the foam, (nx, ns)."""
    depth_mm: float
    """Approach of the indenter since first touch."""
    fluid_pressure_mpa: float
    """Rise of the fluid's pressure over rest; 0 for media without fluid."""
    contact_radius_mm: float
    """Contact radius: sqrt(5/2 <r²>), weighted with the contact pressure (exact for Hertz)."""
    residual: float
    """Relative residual of the solver."""
    tangential_displacement_mm: FloatArray | None = None
    """Displacement of the outer surface along x and s, (2, nx, ns): by the press without friction, and by a slide.
    None: the sensor's spec does not state that its transducer uses it (`reads_shear`)."""
    shear_mpa: FloatArray | None = None
    """Shear traction of the indenter on the outer surface along x and s, (2, nx, ns), positive where it pulls the skin
    towards larger coordinates; zero without a slide. Its sum over cells times their area is the tangential force on the
    sensor. None: as above."""


@dataclass(frozen=True)
class Part:
    """Rows of one role, in the form that estimators take."""

    X: FloatArray
    """Features, (n, features)."""
    y: npt.NDArray[Any]
    """Targets: (n,) numbers, (n, components) vectors, or class indices 0 … n_classes-1."""
    time_s: FloatArray
    """Times since the recording's first sample, (n,) [s]; the row index when there is no clock."""
    recording: IntArray
    """Index of the row's recording in the dataset, (n,)."""
    row: IntArray
    """Index of the row in that recording, (n,)."""

    def __len__(self) -> int:
        return len(self.y)


@dataclass(frozen=True)
class Fold:
    """A training and a test set, with validation data where the protocol has any."""

    name: str
    train: Part
    test: Part
    validation: Part | None = None


@dataclass(frozen=True)
class Answers:
    """Predictions of an estimator for the rows of one role, beside the true values."""

    y_true: npt.NDArray[Any]
    """True values: (n,) numbers, (n, components) vectors, or class indices."""
    y_pred: npt.NDArray[Any]
    """Predictions, of the same shape."""
    recording: IntArray
    """Index of the row's recording in the cell, (n,)."""
    row: IntArray
    """Index of the row in that recording, (n,)."""
    fold: IntArray
    """Fold in which the row was predicted, (n,)."""
    time_s: FloatArray
    """Times since the recording's first sample, (n,) [s]; the row index when there is no clock."""
    force_n: FloatArray
    """Reference force as it was recorded, (n,) [N]; NaN where there is none."""

    def __len__(self) -> int:
        return len(self.y_true)

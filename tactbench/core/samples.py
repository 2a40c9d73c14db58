"""Types of the data that pass from rig to leaderboard, in stages.

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
    """A numpy array of float64 numbers of any shape."""
    IntArray = npt.NDArray[np.int64]
else:
    FloatArray = IntArray = Any  # listings and cached runs import no numpy


class Quality(IntFlag):
    """Quality flags of one sample of one channel; 0 is a good sample."""

    GOOD = 0
    MISSING = 1
    """The sample is missing: the stored number has no meaning."""
    SATURATED = 2
    """The converter was at its upper or lower limit."""
    SUSPECT = 4
    """The sample had an error of parity, checksum or sequence."""
    GAP = 8
    """The sample is good, but rows before it were lost: in transit, or between reading and writing."""


@dataclass(frozen=True)
class Block:
    """A block of consecutive samples of one stream, as a rig yields it."""

    stream: str
    t_ns: IntArray | None
    """Times, (n,) [ns]; from a device with its own clock, the times of arrival at the host. None: there is no clock."""
    data: npt.NDArray[Any]
    """Samples, (n, channels), in the units of the stream's channels."""
    quality: npt.NDArray[np.uint8] | None = None
    """Quality flags of the samples, (n, channels) of :class:`Quality`; None: all samples are good."""
    sequence: IntArray | None = None
    """The device's own number of each sample, (n,), continued when the counter wraps; None: there are no numbers."""
    device_ns: IntArray | None = None
    """Times of the device's own clock, (n,) [ns], continued when the counter wraps; None: it has no clock. The times go
    back where the count was lost."""

    def rows(self, which: slice | npt.NDArray[np.bool_]) -> Block:
        """Return the block with only the rows of a slice or a mask."""
        return replace(self, **{name: one[which] for name in COLUMNS if (one := getattr(self, name)) is not None})


COLUMNS = ("t_ns", "data", "quality", "sequence", "device_ns")
"""Names of the columns of a block of samples."""


def join_blocks(blocks: Sequence[Block]) -> Block:
    """Return the blocks of one stream joined into one; raise ValueError if their columns do not fit each other."""
    import numpy as np

    given = [name for name in COLUMNS if getattr(blocks[0], name) is not None]
    whole: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in blocks]) for name in given}
    return replace(blocks[0], **whole)


@dataclass(frozen=True)
class StreamData:
    """Data of one stream, as read from a recording."""

    spec: StreamSpec
    t_ns: IntArray | None
    """Times, (n,) [ns], on the host's clock if there are several clocks; None: the source has no clock."""
    data: npt.NDArray[Any]
    """Samples, (n, channels), in the units of the stream's channels."""
    quality: npt.NDArray[np.uint8] | None
    annotations: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    """Labels of the rows, arrays (n,) of str or int by name."""
    sequence: IntArray | None = None
    """Numbers of the samples by the device's own counter, (n,); None: there are no numbers."""
    device_ns: IntArray | None = None
    """Times of the device's own clock, (n,) [ns]; None: it has no clock."""
    host_ns: IntArray | None = None
    """Times at which the samples reached the host, (n,) [ns], if `t_ns` was computed from `device_ns`."""


@dataclass(frozen=True)
class StreamReadings:
    """One stream of a recording, on its own clock, for computing features of a whole recording."""

    stream: str
    channels: tuple[str, ...]
    kinds: tuple[str, ...]
    """Kind of each of the channels, in order."""
    data: FloatArray
    """Samples, (n, channels), without rows in which any channel has no sample."""
    time_s: FloatArray | None
    """Times, (n,) [s] since the first sample that the protocol keeps; None: there is no clock."""
    rate_hz: float | None
    """Sample rate, by the median step of the clock, or else as stated [Hz]; None: neither is known."""


@dataclass(frozen=True)
class SkinGrid:
    """Centres of the grid cells of the unrolled skin, in mm."""

    x_mm: FloatArray
    """Axial coordinates of the centres, (nx,) [mm]."""
    s_mm: FloatArray
    """Coordinates of the centres along the arc, (ns,) [mm]."""

    @property
    def cell_mm(self) -> tuple[float, float]:
        """Spacing of the cell centres in x and s [mm]."""
        return float(self.x_mm[1] - self.x_mm[0]), float(self.s_mm[1] - self.s_mm[0])


@dataclass(frozen=True)
class SkinState:
    """The skin under one load, from which a transducer computes readings; units are mm, N and MPa."""

    grid: SkinGrid
    force_n: float
    deflection_mm: FloatArray
    """Deflection of the skin, (nx, ns) [mm], positive towards the core."""
    pressure_mpa: FloatArray
    """Contact pressure, (nx, ns) [MPa]."""
    thickness_mm: FloatArray
    """Remaining thickness of the film or the foam, (nx, ns) [mm]."""
    depth_mm: float
    """Displacement of the indenter since first touch [mm]."""
    fluid_pressure_mpa: float
    """Rise of the fluid's pressure above rest [MPa]; 0 for a skin without fluid."""
    contact_radius_mm: float
    """Contact radius [mm]: sqrt(5/2 <r²>), averaged with the contact pressure as weight (exact for Hertz)."""
    residual: float
    """Relative residual of the solver's equations [1]."""
    tangential_displacement_mm: FloatArray | None = None
    """Displacement of the outer surface along x and s, (2, nx, ns) [mm], by the press without friction and by a slide.
    None: the sensor's spec does not state that its transducer uses it (`reads_shear`)."""
    shear_mpa: FloatArray | None = None
    """Shear traction of the indenter on the outer surface along x and s, (2, nx, ns) [MPa], positive where it pulls the
    skin towards larger coordinates; zero without a slide. Its sum times the area of a cell is the tangential force on
    the sensor. None: as for the displacement."""


@dataclass(frozen=True)
class Part:
    """Rows of one role (training, validation or test), in the form that estimators take."""

    X: FloatArray
    """Features of the rows, (n, features)."""
    y: npt.NDArray[Any]
    """Targets of the rows: (n,) numbers, (n, components) vectors, or class indices 0 … n_classes-1."""
    time_s: FloatArray
    """Times since the recording's first sample, (n,) [s]; the row index if there is no clock."""
    recording: IntArray
    """Index, for each row, of its recording in the dataset, (n,)."""
    row: IntArray
    """Index, for each row, of the row within its recording, (n,)."""

    def __len__(self) -> int:
        return len(self.y)


@dataclass(frozen=True)
class Fold:
    """A training and a test set, with a validation set if the protocol has one."""

    name: str
    train: Part
    test: Part
    validation: Part | None = None


@dataclass(frozen=True)
class Answers:
    """Predictions of an estimator for the rows of one role, with the true values."""

    y_true: npt.NDArray[Any]
    """True values of the rows: (n,) numbers, (n, components) vectors, or class indices."""
    y_pred: npt.NDArray[Any]
    """Predictions for the rows, of the same shape as the true values."""
    recording: IntArray
    """Index, for each row, of its recording in the cell, (n,)."""
    row: IntArray
    """Index, for each row, of the row within its recording, (n,)."""
    fold: IntArray
    """Index, for each row, of the fold in which it was predicted, (n,)."""
    time_s: FloatArray
    """Times since the recording's first sample, (n,) [s]; the row index if there is no clock."""
    force_n: FloatArray
    """Reference force as recorded, (n,) [N]; NaN for rows without a reference force."""

    def __len__(self) -> int:
        return len(self.y_true)

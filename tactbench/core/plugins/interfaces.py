"""Interfaces of the code that descriptors name."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from tactbench.core.samples import Block, SkinGrid, SkinState
from tactbench.core.spec.recording import PlanEntry, Scalar, StreamCounts
from tactbench.core.spec.rig import EffectDescriptor, IndenterDescriptor, RigDescriptor, SensorDescriptor
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import ChannelKind, ChannelSpec, SensorSpec, StreamSpec

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from tactbench.core.samples import FloatArray


class Acquisition(Protocol):
    """A scene that is carried out by iterating over its blocks; the attributes remain valid afterwards."""

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The sensor's streams that will be recorded (those of its spec, perhaps with fewer channels)."""

    @property
    def reference(self) -> tuple[StreamSpec, ...]:
        """The reference streams, for example `force_torque` with channel `fz` of kind `force`."""

    @property
    def plan(self) -> tuple[PlanEntry, ...]:
        """Effects included and left out, with reasons; empty for a real rig."""

    @property
    def assumptions(self) -> Mapping[str, Scalar]:
        """Assumed parameters that decide the result."""

    @property
    def drawn(self) -> Mapping[str, Scalar]:
        """Facts that were drawn or achieved: the placement; ``remark …`` are texts that are shown with every score."""

    def __iter__(self) -> Iterator[Block]: ...


class SimulatedPress(Acquisition, Protocol):
    """A simulated acquisition with a force curve of the skin, for an emulated motor."""

    def press_curve(self, largest_n: float) -> tuple[FloatArray, FloatArray]:
        """Return the indenter's depths, (n,) [m] ascending from the first touch, and the forces at them, (n,) [N].

        The last force is `largest_n`. The curve is that of a slow press, without hysteresis.
        """


class DeviceAcquisition(Acquisition, Protocol):
    """An acquisition from devices, with more facts once it is over."""

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """Counts of the rows of each stream, as far as the rig knows them."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Counts of its drivers, by device and name."""

    @property
    def ended(self) -> str:
        """Reason for an end before its time, which makes its recording incomplete; empty: it ended in time."""


@dataclass(frozen=True)
class DeviceLog:
    """Contents of one log."""

    streams: tuple[StreamSpec, ...]
    """Streams of the sensor's spec that the log has, perhaps with fewer channels."""
    blocks: Sequence[Block]
    """Blocks of the streams, in time order within each."""
    clock: Literal["device", "host", "nominal", "none"]
    """Origin of the times: the device, the host that wrote the log, row number by nominal rate, or none."""
    started: str = ""
    """Time at which the log was begun, as the file states it; empty: it states none."""
    remarks: tuple[str, ...] = ()
    """Sentences that are shown with every score from the log."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Counts of the reader, by name."""


@dataclass(frozen=True)
class RecordingRequest:
    """A recording that is to be made."""

    sensor: SensorDescriptor
    rig: RigDescriptor
    scene: Scene
    path: Path
    seed: int
    role: Role | None = None
    rig_file: RigFile | None = None
    """Devices of the rig; emulated ones are marked so, whatever the rig states."""
    name: str = ""
    """Name of the recording; empty: that of the scene."""
    provenance: Mapping[str, Any] = field(default_factory=dict)


class Rig(Protocol):
    """A rig, which carries out scenes."""

    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> AbstractContextManager[Acquisition]:
        """Prepare `scene` with `sensor`; raises RigError or NotApplicable if it cannot be done."""


class Explained(NamedTuple):
    """An effect of a plan, and its cost."""

    entry: PlanEntry
    cost_s: float | None
    """Time of the effect for a recording on this machine [s]; None: not measured, or not separable from another's."""
    remark: str = ""
    """Reason for the lack of a cost."""


class Explaining(Rig, Protocol):
    """A simulated rig that explains its plan and the cost of each effect."""

    def explain(self, sensor: SensorDescriptor, scene: Scene, *, rounds: int = ...) -> Sequence[Explained]:
        """Return every installed effect, the included ones first, in the order in which they are applied.

        `rounds` > 0 carries the scene out that often, for the median cost of each effect.
        """


@dataclass(frozen=True)
class Verdict:
    """A computed number beside that of a law or a closed form."""

    name: str
    """Quantity that was computed: ``Hertz: depth under a paraboloid``."""
    found: float
    expected: float
    bound: float
    """Largest allowed difference of the two, included."""
    unit: str = "1"
    source: str = ""
    """The law with its source, and the reason for the bound."""

    @property
    def met(self) -> bool:
        """Whether the two agree within the bound; NaN never does."""
        return bool(abs(self.found - self.expected) <= self.bound)


@dataclass(frozen=True)
class CheckTable:
    """A table about the actions of a rig by its file."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    """Rows of texts, one for each column of `head`."""


@dataclass(frozen=True)
class RigCheck:
    """Actions of a rig by its file, and the faults of the file."""

    tables: tuple[CheckTable, ...]
    problems: tuple[str, ...]
    """Reasons to refuse the file, each with the next step; empty: it may be used."""
    file: RigFile | None = None
    """The file with all that the rig's settings add to its axes; None: it has no axes."""
    travel_ceiling_n: float = 0.0
    """Norm of the force at which an axis halts that does not press."""


@dataclass(frozen=True)
class CostPoint:
    """Cost and error of one way of computing something."""

    subject: str
    """Name of the sensor that is computed."""
    observable: str
    """Kind of channel whose error is given."""
    label: str
    """Short name of the way: ``default, 48 x 64, 16 nodes``."""
    seconds: float
    """Median time of the work that the diagram's title names."""
    error: float
    """Root mean square of the difference to the reference."""
    worst: float
    """Largest difference."""
    unit: str
    floor: float
    """Standard deviation of the observable's own noise; infinity where it has none."""
    default: bool
    """Whether this is the default."""
    rung: str
    """Name of the rung that this is; empty: it is none."""
    settings: Mapping[str, Scalar]
    """Settings of this way."""


class CostJob(NamedTuple):
    """A way that is still to be measured."""

    label: str
    run: Callable[[], list[CostPoint]]
    """Function that measures it; a TactbenchError that it raises, where it cannot be measured, becomes a row."""
    rung: str = ""
    """The rung of its points."""


class CostStudy(NamedTuple):
    """A diagram of cost and error, and the measurements for it."""

    title: str
    reference: str
    """Reference of the errors, in one sentence."""
    jobs: Sequence[CostJob]
    """Measurements in order; the first also computes the reference."""


class ReplayRig(Protocol):
    """A rig with recordings of scenes that were carried out elsewhere."""

    def recordings(self) -> Sequence[Path]:
        """Return the files, in a fixed order; raises MissingRecordingError if there are none."""


class Transducer(Protocol):
    """Conversion of skin states into a sensor's noise-free readings, for one grid."""

    def __call__(self, state: SkinState) -> FloatArray:
        """Return the (n_wanted,) readings in the channels' own units, before noise, rounding and clipping."""


class TransducerFactory(Protocol):
    """Factory of a transducer, which ``SensorDescriptor.transducer`` names."""

    def __call__(self, sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str]) -> Transducer:
        """Return a transducer for `grid` and some channels; raises RigError for a channel that it cannot give."""


class Reason(NamedTuple):
    """Answer of ``EffectDescriptor.called_for``: whether a scene calls for the effect, and the reason."""

    called_for: bool
    text: str
    change: float | None = None
    """Change of an observed channel if the effect is left out: an upper bound if it is not called for (0: exactly
    nothing), an estimate if it is. None: not known without computing it."""
    unit: str = "count"
    """Unit of `change`."""


class EffectTrack(Protocol):
    """The recorded channels that share one clock, in the form that effects change."""

    @property
    def channels(self) -> tuple[ChannelSpec, ...]:
        """Channels in the order of the sensor's streams."""

    @property
    def t_s(self) -> FloatArray:
        """(n,) seconds since the recording's first sample."""

    @property
    def force_n(self) -> FloatArray:
        """(n,) true normal force at these samples."""

    @property
    def readings(self) -> FloatArray:
        """Readings of the channels in their own units, (n, channels), which an effect changes in place."""

    @property
    def quality(self) -> npt.NDArray[np.uint8]:
        """Marks of the readings, (n, channels) of :class:`Quality`, which an effect may set."""

    def by_kind(self) -> Mapping[ChannelKind, Sequence[int]]:
        """Return the columns of each kind of channel."""


class EffectRun(Protocol):
    """A recording in the making, which is passed to ``EffectDescriptor.where``.

    The generators are the same under the same seed and names, whatever other effects draw.
    """

    @property
    def sensor(self) -> SensorDescriptor:
        """The sensor, with the nuisances that hold for this scene."""

    @property
    def scene(self) -> Scene:
        """The scene that is carried out."""

    @property
    def tracks(self) -> Sequence[EffectTrack]:
        """The sensor's channels, clock by clock."""

    def of_unit(self, *what: str) -> np.random.Generator:
        """Return the generator for draws that hold for this sensor unit in every recording."""

    def of_session(self, *what: str) -> np.random.Generator:
        """Return the generator for draws that the recordings of a session share."""

    def of_recording(self, *what: str) -> np.random.Generator:
        """Return the generator for draws of this recording only."""


class Estimator(Protocol):
    """An estimator with the two methods of scikit-learn."""

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Any:
        """Fit the estimator to features (n, features) and targets."""

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return predictions for features (n, features)."""


class Operator(Protocol):
    """An operator at a rig of real devices."""

    def prompt(self, text: str) -> None:
        """Show what is to be done, and return when it is done; raises RigError if no operator can answer."""


@dataclass(frozen=True)
class RigContext:
    """Argument of ``RigDescriptor.where``, which builds a rig."""

    effects: tuple[EffectDescriptor, ...] = ()
    """The effects of tactbench, which are candidates for every scene."""
    named_effects: tuple[EffectDescriptor, ...] = ()
    """The installed effects of other packages, which are candidates where
    :func:`tactbench.plugin.simulation.effect_names` has their names."""
    indenters: tuple[IndenterDescriptor, ...] = ()
    """All installed shapes of indenters; the twin presses with them."""
    recordings: Path | None = None
    """Folder given by ``--recordings``."""
    rig_file: RigFile | None = None
    """The file given by ``--rig-file``."""
    operator: Operator | None = None
    """Operator at the rig; None: there is none."""

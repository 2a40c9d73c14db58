"""Interfaces of the code to which plugins' descriptors refer."""

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
    """A scene in progress, carried out by iterating over its blocks; the attributes remain valid afterwards."""

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The sensor's streams to be recorded: those of its spec, possibly with fewer channels."""

    @property
    def reference(self) -> tuple[StreamSpec, ...]:
        """Streams of the reference, for example `force_torque` with channel `fz` of kind `force`."""

    @property
    def plan(self) -> tuple[PlanEntry, ...]:
        """Effects that are included or left out, with reasons; empty for a real rig."""

    @property
    def assumptions(self) -> Mapping[str, Scalar]:
        """Assumed parameters that strongly affect the result, by name."""

    @property
    def drawn(self) -> Mapping[str, Scalar]:
        """Facts drawn at random or achieved: the placement; a ``remark …`` is a text shown with every score."""

    def __iter__(self) -> Iterator[Block]: ...


class SimulatedPress(Acquisition, Protocol):
    """A simulated acquisition that can compute the skin's force curve, for an emulated motor."""

    def press_curve(self, largest_n: float) -> tuple[FloatArray, FloatArray]:
        """Return ascending depths of the indenter from first touch, (n,) [m], and the forces at these depths, (n,) [N].

        The last force is `largest_n`. The curve is that of a slow press, without hysteresis.
        """


class DeviceAcquisition(Acquisition, Protocol):
    """An acquisition from devices, with further facts that are available after its end."""

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """Row counts of each stream, as far as they are available to the rig."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Counts that the drivers kept, by device and name."""

    @property
    def ended(self) -> str:
        """Reason for an early end, which makes the recording incomplete; empty: the acquisition ended in time."""


@dataclass(frozen=True)
class DeviceLog:
    """Contents of one log file of a device."""

    streams: tuple[StreamSpec, ...]
    """Streams of the sensor's spec that the log contains, possibly with fewer channels."""
    blocks: Sequence[Block]
    """Blocks of samples of the streams, in time order within each stream."""
    clock: Literal["device", "host", "nominal", "none"]
    """Origin of the times: the device, the host that wrote the log, row number by nominal rate, or none."""
    started: str = ""
    """Time at which logging began, as stated in the file; empty: not stated."""
    remarks: tuple[str, ...] = ()
    """Sentences to be shown with every score from the log."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Counts from reading the log, by name."""


@dataclass(frozen=True)
class RecordingRequest:
    """Description of a recording to be made."""

    sensor: SensorDescriptor
    rig: RigDescriptor
    scene: Scene
    path: Path
    seed: int
    role: Role | None = None
    rig_file: RigFile | None = None
    """Devices of the rig; the recording marks emulated ones even if the rig does not state them."""
    name: str = ""
    """Name of the recording; empty: the name of the scene."""
    provenance: Mapping[str, Any] = field(default_factory=dict)


class Rig(Protocol):
    """A rig, which carries out scenes and yields their samples."""

    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> AbstractContextManager[Acquisition]:
        """Prepare `scene` with `sensor`; raise RigError or NotApplicable if the scene cannot be carried out."""


class Explained(NamedTuple):
    """An effect in a simulation's plan, and its computing time."""

    entry: PlanEntry
    cost_s: float | None
    """Computing time of the effect for a recording on this machine [s]; None: not measured, or not separable."""
    remark: str = ""
    """Reason why the computing time is not available."""


class Explaining(Rig, Protocol):
    """A simulated rig that can list its effects and the computing time of each."""

    def explain(self, sensor: SensorDescriptor, scene: Scene, *, rounds: int = ...) -> Sequence[Explained]:
        """Return all installed effects in the order of their application, the included effects first.

        If `rounds` > 0, the scene is carried out that many times, for the median computing time of each effect.
        """


@dataclass(frozen=True)
class Verdict:
    """A computed number, and the number from a physical law or an exact solution."""

    name: str
    """Name of the computed quantity: ``Hertz: depth under a paraboloid``."""
    found: float
    expected: float
    bound: float
    """Largest allowed difference between the two numbers, inclusive."""
    unit: str = "1"
    source: str = ""
    """The physical law with its source, and the reason for the bound."""

    @property
    def met(self) -> bool:
        """True if the two numbers agree within the bound; False for NaN."""
        return bool(abs(self.found - self.expected) <= self.bound)


@dataclass(frozen=True)
class CheckTable:
    """A table of the actions of a rig, as planned in its rig file."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    """Rows, each of one text for each column of `head`."""


@dataclass(frozen=True)
class RigCheck:
    """Planned actions of a rig by its rig file, and the faults of the file."""

    tables: tuple[CheckTable, ...]
    problems: tuple[str, ...]
    """Reasons for refusing the rig file, each with the next step; empty: the file is valid."""
    file: RigFile | None = None
    """The rig file, with the values that the rig's settings add to its axes; None: it has no axes."""
    travel_ceiling_n: float = 0.0
    """Norm of the force at which an axis that does not press halts."""


@dataclass(frozen=True)
class CostPoint:
    """Computing time and error of one setting of a computation."""

    subject: str
    """Name of the sensor whose readings are computed."""
    observable: str
    """Kind of channel to which the error refers."""
    label: str
    """Short name of the setting: ``default, 48 x 64, 16 nodes``."""
    seconds: float
    """Median time of the work named in the diagram's title."""
    error: float
    """Root mean square of the difference from the reference solution."""
    worst: float
    """Largest difference from the reference solution."""
    unit: str
    floor: float
    """Standard deviation of the observable's own noise; infinity for an observable without noise."""


class CostJob(NamedTuple):
    """A measurement of computing time and error that is still to be made."""

    label: str
    run: Callable[[], list[CostPoint]]
    """Function that makes the measurement; a TactbenchError raised in it becomes a row."""


class CostStudy(NamedTuple):
    """A diagram of computing time and error, and the measurements for it."""

    title: str
    reference: str
    """Reference solution from which errors are computed, in one sentence."""
    jobs: Sequence[CostJob]
    """Measurements in order; the first measurement also computes the reference."""


class ReplayRig(Protocol):
    """A rig that returns recordings of scenes carried out elsewhere."""

    def recordings(self) -> Sequence[Path]:
        """Return the files of recordings in a fixed order; raise MissingRecordingError if there is no recording."""


class Transducer(Protocol):
    """Conversion of skin states to the noise-free readings of a sensor, on one grid."""

    def __call__(self, state: SkinState) -> FloatArray:
        """Return the (n_wanted,) readings in the units of the channels, before noise, rounding and clipping."""


class TransducerFactory(Protocol):
    """Factory of a transducer, to which ``SensorDescriptor.transducer`` refers."""

    def __call__(self, sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str]) -> Transducer:
        """Return a transducer for `grid` and the wanted channels; raise RigError for a channel it does not support."""


class Reason(NamedTuple):
    """Result of ``EffectDescriptor.called_for``: the decision whether a scene needs the effect, and its reason."""

    called_for: bool
    text: str
    change: float | None = None
    """Change of an observed channel if the effect is left out: an upper bound (0: exactly no change) if it is not
    needed, an estimate if it is needed. None: not known without computing the effect."""
    unit: str = "count"
    """Unit of `change`, as text."""


class EffectTrack(Protocol):
    """Recorded channels with a common clock, in a form that effects can change."""

    @property
    def channels(self) -> tuple[ChannelSpec, ...]:
        """Channels on this clock, in the order of the sensor's streams."""

    @property
    def t_s(self) -> FloatArray:
        """(n,) times since the recording's first sample [s]."""

    @property
    def force_n(self) -> FloatArray:
        """(n,) true normal force at the times of the samples [N]."""

    @property
    def readings(self) -> FloatArray:
        """Readings, (n, channels), in the units of the channels; an effect changes them in place."""

    @property
    def quality(self) -> npt.NDArray[np.uint8]:
        """Quality of the readings, (n, channels) of :class:`Quality`; an effect may change it."""

    def by_kind(self) -> Mapping[ChannelKind, Sequence[int]]:
        """Return the column numbers of the channels, by kind of channel."""


class EffectRun(Protocol):
    """A simulated recording in progress, passed to ``EffectDescriptor.where``.

    The random generators depend on seed and names only, not on the draws of other effects.
    """

    @property
    def sensor(self) -> SensorDescriptor:
        """The sensor, with the nuisances that apply to this scene."""

    @property
    def scene(self) -> Scene:
        """The scene that is being simulated."""

    @property
    def tracks(self) -> Sequence[EffectTrack]:
        """The sensor's channels, grouped by clock."""

    def of_unit(self, *what: str) -> np.random.Generator:
        """Return the random generator for draws that are constant for this sensor unit, over all recordings."""

    def of_session(self, *what: str) -> np.random.Generator:
        """Return the random generator for draws that are common to the recordings of a session."""

    def of_recording(self, *what: str) -> np.random.Generator:
        """Return the random generator for draws that apply to this recording only."""


class Estimator(Protocol):
    """An estimator with the methods fit and predict of scikit-learn."""

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Any:
        """Fit the estimator to (n, features) features and their (n,) or (n, components) targets."""

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Return one prediction for each row of the (n, features) features."""


class Operator(Protocol):
    """The person who operates a rig of real devices."""

    def prompt(self, text: str) -> None:
        """Show an instruction, and return once it is carried out; raise RigError if no operator can answer."""


@dataclass(frozen=True)
class RigContext:
    """Argument of ``RigDescriptor.where``, the function that builds a rig."""

    effects: tuple[EffectDescriptor, ...] = ()
    """Effects of tactbench by name; all are candidates for every scene."""
    named_effects: tuple[EffectDescriptor, ...] = ()
    """Installed effects of other packages, which are candidates if :func:`tactbench.plugin.simulation.effect_names`
    includes their names."""
    indenters: tuple[IndenterDescriptor, ...] = ()
    """All installed indenter shapes, which a simulated rig presses on sensors."""
    recordings: Path | None = None
    """Folder of recordings, from the option ``--recordings``."""
    rig_file: RigFile | None = None
    """Rig file, from the option ``--rig-file``."""
    operator: Operator | None = None
    """The person who operates the rig; None: no person is present."""

"""What the code behind a descriptor must look like."""

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
    """One scene being carried out: iterate it for blocks; the other attributes are valid afterwards too."""

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
        """What was drawn or achieved, for example the placement.

        Texts whose names start with ``remark`` and a blank are shown with every score from the recording.
        """

    def __iter__(self) -> Iterator[Block]: ...


class SimulatedPress(Acquisition, Protocol):
    """A simulated acquisition that also says how the skin answers to being pressed: what an emulated motor feels."""

    def press_curve(self, largest_n: float) -> tuple[FloatArray, FloatArray]:
        """Return the indenter's ascending depths (n,) [m] from the first touch, and the force (n,) [N] at each.

        The last force is `largest_n`. The curve is that of a slow press: the same on the way in and out.
        """


class DeviceAcquisition(Acquisition, Protocol):
    """An acquisition from devices says more, once it is over."""

    @property
    def stream_counts(self) -> Mapping[str, StreamCounts]:
        """By stream: what became of its rows, as far as the rig knows."""

    @property
    def counts(self) -> Mapping[str, int]:
        """What its drivers counted, by device and name."""

    @property
    def ended(self) -> str:
        """Why it ended before its time; empty: it did not. Its recording is then incomplete."""


@dataclass(frozen=True)
class DeviceLog:
    """The contents of one log."""

    streams: tuple[StreamSpec, ...]
    """What `blocks` are of: the streams of the sensor's spec that the log has, perhaps with fewer channels."""
    blocks: Sequence[Block]
    """In time order within each stream."""
    clock: Literal["device", "host", "nominal", "none"]
    """Who made the times: the device, the host that wrote the log, row number by rate, or nobody."""
    started: str = ""
    """When the log was begun, as the file states it; empty if it does not."""
    remarks: tuple[str, ...] = ()
    """What a reader of a score from it must know."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """What was counted on the way in, by name."""


@dataclass(frozen=True)
class RecordingRequest:
    """One recording to be made."""

    sensor: SensorDescriptor
    rig: RigDescriptor
    scene: Scene
    path: Path
    seed: int
    role: Role | None = None
    rig_file: RigFile | None = None
    """The devices: what is emulated is marked so, whatever the rig says of it."""
    name: str = ""
    """Of the recording; empty: that of the scene."""
    provenance: Mapping[str, Any] = field(default_factory=dict)


class Rig(Protocol):
    """Something that carries out scenes."""

    def open(self, sensor: SensorDescriptor, scene: Scene, *, seed: int) -> AbstractContextManager[Acquisition]:
        """Prepare `scene` with `sensor`; raises RigError or NotApplicable if it cannot be done."""


class Explained(NamedTuple):
    """One effect of a plan, and what it costs."""

    entry: PlanEntry
    cost_s: float | None
    """Seconds it takes, or would take if it was asked for, per recording on this machine; None: not measured, or not
    to be told apart from another one's."""
    remark: str = ""
    """Why there is no cost, where that is worth a word."""


class Explaining(Rig, Protocol):
    """A simulated rig that says what it would do, and what that costs."""

    def explain(self, sensor: SensorDescriptor, scene: Scene, *, rounds: int = 0) -> Sequence[Explained]:
        """Return every installed effect, those included first, in the order in which they are applied.

        `rounds` > 0 carries the scene out so many times and gives the median cost of each effect.
        """


@dataclass(frozen=True)
class Verdict:
    """One number held against the one that a law or a closed form gives."""

    name: str
    """What was computed, in one line: ``Hertz: depth under a paraboloid``."""
    found: float
    expected: float
    bound: float
    """Largest difference of the two that is allowed, included."""
    unit: str = "1"
    source: str = ""
    """The law, where it stands, and the reason for the bound."""

    def __post_init__(self) -> None:
        """Keep plain numbers: a NumPy scalar would be no JSON."""
        for name in ("found", "expected", "bound"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def met(self) -> bool:
        """Whether the two agree within the bound; not a number never does."""
        return abs(self.found - self.expected) <= self.bound


@dataclass(frozen=True)
class CheckTable:
    """Some of what a rig would do by its file."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    """As many texts each as there are in `head`."""


@dataclass(frozen=True)
class RigCheck:
    """What a rig would do by its file, and why it would not."""

    tables: tuple[CheckTable, ...]
    problems: tuple[str, ...]
    """Each a reason to refuse the file, with the next step; empty: it may be used."""
    file: RigFile | None = None
    """The file with all that its axes are told by the rig's settings; None: it has no axes."""
    travel_ceiling_n: float = 0.0
    """Norm of the force at which an axis halts that does not press."""


@dataclass(frozen=True)
class CostPoint:
    """One way of computing something: what it takes, and how far off it is."""

    subject: str
    """What is computed for: a sensor."""
    observable: str
    """What is looked at: a kind of channel."""
    label: str
    """Short name of the way: ``default, 48 x 64, 16 nodes``."""
    seconds: float
    """Median time of one piece of work, as the diagram's title says."""
    error: float
    """Root mean square of the difference to the reference."""
    worst: float
    """Largest difference."""
    unit: str
    floor: float
    """Standard deviation of the noise the observable has anyway; infinity where it has none."""
    default: bool = False
    """This is what users get who ask for nothing."""
    rung: str = ""
    """Name of the rig's rung that this way is; empty: it is none."""
    settings: Mapping[str, Scalar] = field(default_factory=dict)
    """What was set."""


class CostJob(NamedTuple):
    """One way still to be measured."""

    label: str
    run: Callable[[], list[CostPoint]]
    """Raises a TactbenchError if this sensor cannot have it: the reason becomes a row."""
    rung: str = ""
    """As CostPoint's."""


class CostStudy(NamedTuple):
    """A diagram in the making: what its points mean, and how to get them."""

    title: str
    reference: str
    """What the errors are measured against, in one sentence."""
    jobs: Sequence[CostJob]
    """In order; the reference is computed with the first."""


class ReplayRig(Protocol):
    """A rig whose scenes were carried out elsewhere: it hands out recordings that exist."""

    def recordings(self) -> Sequence[Path]:
        """Return the files, in a fixed order; raises MissingRecordingError if there are none."""


class Transducer(Protocol):
    """Turns skin states into a sensor's noise-free readings, for one grid."""

    def __call__(self, state: SkinState) -> FloatArray:
        """Return the (n_wanted,) readings in the channels' own units, before noise, rounding and clipping."""


class TransducerFactory(Protocol):
    """What ``SensorDescriptor.transducer`` names."""

    def __call__(self, sensor: SensorSpec, grid: SkinGrid, channel_names: Sequence[str]) -> Transducer:
        """Prepare for `grid` and the channels of `channel_names`; raises RigError for a channel it cannot give."""


class Reason(NamedTuple):
    """What ``EffectDescriptor.called_for`` answers: whether a scene calls for the effect, and why or why not."""

    called_for: bool
    text: str
    change: float | None = None
    """What leaving the effect out changes in an observed channel: at most, if it is not called for (0: exactly
    nothing); about, if it is. None: unknown without computing it."""
    unit: str = "count"
    """Unit of `change`."""


class EffectTrack(Protocol):
    """The recorded channels that share one clock, as a simulation effect finds them."""

    @property
    def channels(self) -> tuple[ChannelSpec, ...]:
        """In order of the sensor's streams."""

    @property
    def t_s(self) -> FloatArray:
        """(n,) seconds since the recording's first sample."""

    @property
    def force_n(self) -> FloatArray:
        """(n,) true normal force at these samples."""

    @property
    def readings(self) -> FloatArray:
        """(n, channels) what the channels would say, in their own units; an effect changes it in place."""

    @property
    def quality(self) -> npt.NDArray[np.uint8]:
        """(n, channels) of :class:`Quality`; an effect may set bits."""

    def by_kind(self) -> Mapping[ChannelKind, Sequence[int]]:
        """Return the columns of each kind of channel."""


class EffectRun(Protocol):
    """The recording in the making: what ``EffectDescriptor.where`` is called with.

    The generators are the same under the same seed and names, whatever other effects draw.
    """

    @property
    def sensor(self) -> SensorDescriptor:
        """The sensor, with the nuisances that hold for this scene."""

    @property
    def scene(self) -> Scene:
        """What is carried out."""

    @property
    def tracks(self) -> Sequence[EffectTrack]:
        """The sensor's channels, clock by clock."""

    def of_unit(self, *what: str) -> np.random.Generator:
        """Return the generator of what belongs to this sensor unit, in every recording."""

    def of_session(self, *what: str) -> np.random.Generator:
        """Return the generator of what the recordings of a session share."""

    def of_recording(self, *what: str) -> np.random.Generator:
        """Return the generator of what is this recording's own."""


class Estimator(Protocol):
    """scikit-learn's two verbs."""

    def fit(self, X: FloatArray, y: npt.NDArray[Any]) -> Any:
        """Learn."""

    def predict(self, X: FloatArray) -> npt.NDArray[Any]:
        """Answer."""


class Operator(Protocol):
    """Whoever stands at a rig of real devices."""

    def prompt(self, text: str) -> None:
        """Show what is to be done, and return when it is; raises RigError if nobody is there to do it."""


@dataclass(frozen=True)
class RigContext:
    """What a rig is built from: ``RigDescriptor.where`` is called with exactly this."""

    effects: tuple[EffectDescriptor, ...] = ()
    """The effects of tactbench itself: candidates for every scene."""
    named_effects: tuple[EffectDescriptor, ...] = ()
    """The installed effects of other packages: candidates where the sensor or the scene names them, see
    :func:`tactbench.plugin.simulation.effect_names`."""
    indenters: tuple[IndenterDescriptor, ...] = ()
    """All installed shapes of indenters; the twin presses with them."""
    recordings: Path | None = None
    """Folder given by ``--recordings``."""
    rig_file: RigFile | None = None
    """The file given by ``--rig-file``."""
    operator: Operator | None = None
    """None: nobody is there."""

"""What plugins bring, without loading their code."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, model_validator

from tactbench.core.spec.parameter import Parameter, values_of
from tactbench.core.spec.quantity import Frozen, Quantity
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.summary import Summary
from tactbench.core.spec.task import WHERE, TaskSpec

_NAME = r"^[a-z][a-z0-9_-]*$"
EmulatedLink = Literal["bytes", "can", "datagram", "spi"]


class ManualFrame(Frozen):
    """A frame of a byte stream, copied from the maker's manual.

    A mistake that a driver and an emulator of one author share, as a byte order, shows against it alone.
    """

    data: str = Field(pattern=r"^([0-9A-Fa-f]{2}\s*)+$")
    """In hexadecimal."""
    readings: dict[str, float] = Field(min_length=1)
    """What the manual says it holds: channel -> reading, in the channel's unit."""


class SensorDescriptor(Frozen):
    """A sensor, and where the code for it is."""

    spec: SensorSpec
    transducer: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.simulation.Transducer`; needed on the twin only."""
    driver: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.devices.Driver`, called with DriverSettings; for real devices."""
    emulator: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with EmulatorSettings: the device as a model at the far end of `emulated_link`, a
    :class:`tactbench.plugin.devices.DeviceEmulator`, or a SpiDeviceEmulator on SPI."""
    emulated_link: EmulatedLink | None = None
    """What the driver speaks through; needed where there is an emulator."""
    log_reader: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with (Path, options): a DeviceLog; for logs of the device's own tools."""
    emulated_options: dict[str, Scalar | bool] = Field(default_factory=dict)
    """Options that the driver needs and only a real device's papers state, as they are of the emulated one: they hold
    where a rig file's entry of an emulated device leaves them out."""
    manual_frame: ManualFrame | None = None
    """One frame that the driver must decode as the manual does; None: none is at hand."""
    effects: tuple[str, ...] = ()
    """Names of effects of other packages, or of the sensor's own, that are considered wherever it is simulated."""

    @property
    def name(self) -> str:
        """The sensor's name."""
        return self.spec.name


class DeviceDescriptor(Frozen):
    """A device that is no tactile sensor, and where its code is: a reference force sensor, a motor."""

    name: str = Field(pattern=_NAME)
    title: str
    kind: Literal["force", "motor"]
    """What a rig uses it for. The streams of a force sensor have channels of kind `force`."""
    driver: str = Field(pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.devices.Driver`, called with DriverSettings; of a motor, what its
    rig expects."""
    emulator: str | None = Field(default=None, pattern=WHERE)
    """As of a sensor."""
    emulated_link: EmulatedLink | None = None
    """As of a sensor."""
    emulated_options: dict[str, Scalar | bool] = Field(default_factory=dict)
    """As of a sensor."""
    manual_frame: ManualFrame | None = None
    """As of a sensor."""


class TaskDescriptor(Frozen):
    """A task: its spec is all of it."""

    spec: TaskSpec

    @property
    def name(self) -> str:
        """The task's name."""
        return self.spec.name


class RigDescriptor(Frozen):
    """A rig, and where its code is."""

    name: str = Field(pattern=_NAME)
    title: str
    where: str = Field(pattern=WHERE)
    """``module:callable``, called with a :class:`tactbench.plugin.RigContext`: a Rig or a ReplayRig."""
    simulated: bool = False
    """Rows from this rig are marked SIM and never ranked against hardware."""
    replays: bool = False
    """It is a ReplayRig; ``--recordings`` without ``--rig`` asks one of these."""
    references: dict[str, tuple[str, ...]] | None = None
    """Kinds of channels that its reference records, each with their names where they are fixed: what a task asks for
    beyond them is refused before anything is recorded. None: not known beforehand."""
    rungs: tuple[str, ...] = ()
    """Names of the rungs of its ladder of solvers, the cheapest first; for simulated rigs."""
    verification: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called without arguments: the simulation against laws and closed forms, some Verdicts."""
    work_precision: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with a SensorDescriptor and, by name, ``rounds`` (how often a recording is timed): a
    CostStudy of error against seconds per recording."""
    file: str | None = Field(default=None, pattern=WHERE)
    """``module:class``, a RigFile that also checks the rig's own settings: complaints about them then name their
    line."""
    check: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with a RigFile: a RigCheck of what the rig would do, with nothing opened or moved."""
    emulators: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with a RigFile and a registry: RigEmulators, whose motors move and forces answer, for
    real time. None: devices sense what a simulated rig has recorded."""


class EstimatorDescriptor(Frozen):
    """An estimator, and where its code is."""

    name: str = Field(pattern=_NAME)
    title: str
    kinds: tuple[Literal["regression", "classification", "events"], ...]
    """`events`: ``fit`` is given 0 or 1 a frame (whether it slips), ``predict`` gives a score a frame: an alarm needs
    one at or above a threshold."""
    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(kind=..., seed=..., threads=..., **params)``: an object with
    scikit-learn's ``fit(X, y)`` and ``predict(X)``."""
    params: dict[str, Any] = Field(default_factory=dict)
    """Defaults; every name a user may set is here."""
    grid: dict[str, tuple[int | float | str | bool | None, ...]] = Field(default_factory=dict)
    """Parameters chosen on validation data, and their candidates: each keeps its type, 5 is no 5.0."""
    window_grid: tuple[int, ...] = (0,)
    """Candidates for k of the mean filter over samples t-k … t, chosen together with `grid`."""
    looks_at: Literal["features", "time", "nothing", "reference"] = "features"
    """`time`: X is the time index alone. `nothing`: X is a column of zeros. `reference`, of events alone: X is the
    tangential force over friction times normal force, from the reference sensor: an oracle."""
    summaries: tuple[Summary, ...] = ()
    """Of frames: it looks at these numbers of each channel, in place of the task's own."""
    frames_by: str | None = Field(default=None, pattern=WHERE)
    """Of frames: ``module:callable``, called with (one stream, a :class:`tactbench.plugin.StreamReadings`; (n,) ends of
    frames [s]; length of a frame [s]): (n, features) numbers of samples up to each end, instead of summaries. NaN is no
    answer. It is asked of the fastest stream alone."""
    threshold: float | None = None
    """Of events: a threshold of its own; None: chosen on validation recordings."""
    baseline: bool = False
    """A trivial answer, shown under the results."""
    linear: bool | None = None
    """Whether answers are linear in the features (for classes: their boundaries are); None: its author does not say."""
    distributions: tuple[str, ...] = ()
    """Distributions beyond tactbench's own that compute its answers: a cell's key covers their versions."""
    rehearsal: dict[str, Any] | None = None
    """Parameters with which it learns a few rows in no time and leaves no thread behind: it then does so once before
    cells are timed, and what its library does at its first use is in nobody's time. None: it is only built then."""

    @model_validator(mode="after")
    def _nothing_is_searched_of_detectors(self) -> EstimatorDescriptor:
        if "events" in self.kinds and (self.grid or self.window_grid != (0,)):
            raise ValueError(
                "kind events chooses a threshold on validation recordings, and neither grid nor window_grid"
            )
        return self


class EffectDescriptor(Frozen):
    """One physical influence the twin may include."""

    name: str = Field(pattern=_NAME)
    title: str
    where: str = Field(pattern=WHERE)
    """``module:callable``; imported only when a plan includes the effect."""
    produces: tuple[str, ...] = ()
    consumes: tuple[str, ...] = ()
    called_for: str = Field(pattern=WHERE)
    """``module:callable``, called with (Scene, SensorSpec): a Reason; light, no numerics."""
    groups: tuple[str, ...] = ()
    """Words that stand for several effects at once in a scene's ``simulation.effects``: ``drift``, ``noise``."""


class IndenterDescriptor(Frozen):
    """A shape of an indenter, and where its height is computed."""

    name: str = Field(pattern=_NAME)
    title: str
    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(x_mm, y_mm, **dimensions)`` with two arrays that broadcast: the height
    of the body above its lowest point [mm], finite everywhere and 0 at (0, 0). Where a flank is vertical, or there is
    no body, it is large: 50 mm or more."""
    dimensions: dict[str, Parameter] = Field(default_factory=dict)
    """What it is given by, each as a keyword in the parameter's unit."""

    @model_validator(mode="after")
    def _angle_is_the_scenes(self) -> IndenterDescriptor:
        if "angle" in self.dimensions:
            raise ValueError("dimensions: angle is how a scene turns the shape; call it something else")
        return self

    def sizes(self, given: Mapping[str, Quantity]) -> dict[str, float]:
        """Return every dimension, each in its unit: as `given`, or by default; raises UsageError naming one."""
        return values_of(f"The indenter {self.name!r}", self.dimensions, given)


class ProfileDescriptor(Frozen):
    """A normal force over time that has a name, and where it is computed."""

    name: str = Field(pattern=_NAME)
    title: str
    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(**parameters)``: a :class:`tactbench.plugin.ForcePath`. A scene, and
    with it a recording, holds this path and not the profile's name."""
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    """What it is given by, each as a keyword in the parameter's unit."""

    def values(self, given: Mapping[str, Quantity]) -> dict[str, float]:
        """Return every parameter, each in its unit: as `given`, or by default; raises UsageError naming one."""
        return values_of(f"The profile {self.name!r}", self.parameters, given)

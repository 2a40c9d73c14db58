"""Descriptors of what a plugin brings. They name the place of its code, so that a listing imports none of it."""

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
    """A frame of a byte stream from the maker's manual, which shows a mistake that driver and emulator share."""

    data: str = Field(pattern=r"^([0-9A-Fa-f]{2}\s*)+$")
    """Bytes of the frame in hexadecimal."""
    readings: dict[str, float] = Field(min_length=1)
    """Readings that the manual states for the frame, by channel, in the channel's unit."""


class _Named(Frozen):
    name: str = Field(pattern=_NAME)
    title: str


class _Emulated(Frozen):
    emulator: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with EmulatorSettings: the device as a model at the far end of `emulated_link`, a
    :class:`tactbench.plugin.devices.DeviceEmulator`, or a SpiDeviceEmulator on SPI."""
    emulated_link: EmulatedLink | None = None
    """Kind of link that the driver uses; needed where there is an emulator."""
    emulated_options: dict[str, Scalar | bool] = Field(default_factory=dict)
    """Options of the driver that only the papers of a real device state, with their values for the emulated device.
    They hold where a rig file leaves them out."""
    manual_frame: ManualFrame | None = None
    """A frame of the maker's manual, which the driver must decode as the manual does; None: there is none."""


class SensorDescriptor(_Emulated):
    """A sensor, and the places of its code."""

    spec: SensorSpec
    transducer: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.simulation.Transducer`; needed on the twin only."""
    driver: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.devices.Driver`, called with DriverSettings; for real devices."""
    log_reader: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with (Path, options): a DeviceLog; for logs of the device's own tools."""
    effects: tuple[str, ...] = ()
    """Names of effects of other packages, or of the sensor's own, that are candidates wherever it is simulated."""

    @property
    def name(self) -> str:
        """Name of the sensor."""
        return self.spec.name


class DeviceDescriptor(_Emulated, _Named):
    """A device other than a tactile sensor, such as a force sensor or a motor, and the places of its code."""

    kind: Literal["force", "motor"]
    """Use of the device in a rig. The streams of a force sensor have channels of kind `force`."""
    driver: str = Field(pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.devices.Driver`, called with DriverSettings; of a motor, what its
    rig expects."""


class TaskDescriptor(Frozen):
    """A task, which is described by its spec alone."""

    spec: TaskSpec

    @property
    def name(self) -> str:
        """Name of the task."""
        return self.spec.name


class RigDescriptor(_Named):
    """A rig, and the places of its code."""

    where: str = Field(pattern=WHERE)
    """``module:callable``, called with a :class:`tactbench.plugin.RigContext`: a Rig or a ReplayRig."""
    simulated: bool = False
    """Whether rows from this rig are marked SIM, and are never ranked against hardware."""
    replays: bool = False
    """Whether it is a ReplayRig; one of these is used for ``--recordings`` without ``--rig``."""
    references: dict[str, tuple[str, ...]] | None = None
    """Kinds of channels that its reference records, each with their names where they are fixed. A task that needs
    others is refused before anything is recorded. None: they are not known beforehand."""
    rungs: tuple[str, ...] = ()
    """Names of the rungs of a simulated rig's ladder of solvers, the cheapest first."""
    verification: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called without arguments: Verdicts of the simulation against laws and closed forms."""
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


class EstimatorDescriptor(_Named):
    """An estimator, and the place of its code."""

    kinds: tuple[Literal["regression", "classification", "events"], ...]
    """Kinds of tasks that it answers. For `events`, ``fit`` is given 0 or 1 for each frame (whether it slips) and
    ``predict`` returns a score for each: an alarm needs one at or above a threshold."""
    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(kind=..., seed=..., threads=..., **params)``: an object with
    scikit-learn's ``fit(X, y)`` and ``predict(X)``."""
    params: dict[str, Any] = Field(default_factory=dict)
    """Parameters that a user may set, with their defaults."""
    grid: dict[str, tuple[int | float | str | bool | None, ...]] = Field(default_factory=dict)
    """Candidates of the parameters that are chosen on validation data; each keeps its type, 5 is not 5.0."""
    window_grid: tuple[int, ...] = (0,)
    """Candidates for k of the mean filter over samples t-k … t, chosen together with `grid`."""
    looks_at: Literal["features", "time", "nothing", "reference"] = "features"
    """`time`: X is the time index alone. `nothing`: X is a column of zeros. `reference`, of events alone: X is the
    tangential force over friction times normal force, from the reference sensor: an oracle."""
    summaries: tuple[Summary, ...] = ()
    """Numbers of each channel that it uses for frames, in place of the task's own."""
    frames_by: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` for features of frames in place of summaries, called with (one stream, a
    :class:`tactbench.plugin.StreamReadings`; (n,) ends of frames [s]; length of a frame [s]): (n, features) numbers of
    the samples up to each end, NaN where there is no answer. Only the fastest stream is passed."""
    threshold: float | None = None
    """Threshold of its own for events; None: it is chosen on validation recordings."""
    baseline: bool = False
    """Whether it is a trivial estimator, which is shown under the results."""
    linear: bool | None = None
    """Whether answers (or boundaries of classes) are linear in the features; None: not stated."""
    distributions: tuple[str, ...] = ()
    """Distributions beside tactbench that compute its answers; the key of a cell covers their versions."""
    rehearsal: dict[str, Any] | None = None
    """Parameters with which it fits a few rows at once and leaves no thread behind. It then does so before cells are
    timed, so that the first use of its library is in no time. None: it is only built."""

    @model_validator(mode="after")
    def _nothing_is_searched_of_detectors(self) -> EstimatorDescriptor:
        if "events" in self.kinds and (self.grid or self.window_grid != (0,)):
            raise ValueError("kind events has neither grid nor window_grid: only its threshold is chosen")
        return self


class EffectDescriptor(_Named):
    """A physical influence that a simulation may include."""

    where: str = Field(pattern=WHERE)
    """``module:callable``; imported only when a plan includes the effect."""
    produces: tuple[str, ...] = ()
    consumes: tuple[str, ...] = ()
    called_for: str = Field(pattern=WHERE)
    """``module:callable``, called with (Scene, SensorSpec): a Reason; light, no numerics."""
    groups: tuple[str, ...] = ()
    """Names of groups of effects in a scene's ``simulation.effects``: ``drift``, ``noise``."""


class IndenterDescriptor(_Named):
    """A shape of an indenter, and the place of the code for its height."""

    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(x_mm, y_mm, **dimensions)`` with two arrays that broadcast: the height
    of the body above its lowest point [mm], finite everywhere and 0 at (0, 0). Where a flank is vertical, or there is
    no body, it is large: 50 mm or more."""
    dimensions: dict[str, Parameter] = Field(default_factory=dict)
    """Parameters, each passed as a keyword in its own unit."""

    @model_validator(mode="after")
    def _angle_is_the_scenes(self) -> IndenterDescriptor:
        if "angle" in self.dimensions:
            raise ValueError("dimensions: a scene turns the shape by `angle`; rename this one")
        return self

    def sizes(self, given: Mapping[str, Quantity]) -> dict[str, float]:
        """Return every dimension in its unit: as `given`, or its default; raises UsageError for a wrong one."""
        return values_of(f"The indenter {self.name!r}", self.dimensions, given)


class ProfileDescriptor(_Named):
    """A named profile of the normal force, and the place of its code."""

    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(**parameters)``: a :class:`tactbench.plugin.ForcePath`. A scene, and
    with it a recording, holds this path and not the profile's name."""
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    """Parameters, each passed as a keyword in its own unit."""

    def values(self, given: Mapping[str, Quantity]) -> dict[str, float]:
        """Return every parameter in its unit: as `given`, or its default; raises UsageError for a wrong one."""
        return values_of(f"The profile {self.name!r}", self.parameters, given)

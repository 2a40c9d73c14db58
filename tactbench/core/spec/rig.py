"""Descriptors of sensors, rigs and tasks, with the import paths of their code, which is not imported to list them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec.quantity import Frozen, Quantity, Unit
from tactbench.core.spec.recording import Scalar
from tactbench.core.spec.sensor import SensorSpec
from tactbench.core.spec.task import WHERE, Summary, TaskSpec

_NAME = r"^[a-z][a-z0-9_-]*$"
EmulatedLink = Literal["bytes", "can", "datagram", "spi"]


class ManualFrame(Frozen):
    """A frame of a byte stream from the maker's manual; it reveals mistakes that driver and emulator have in common."""

    data: str = Field(pattern=r"^([0-9A-Fa-f]{2}\s*)+$")
    """Bytes of the frame, in hexadecimal notation."""
    readings: dict[str, float] = Field(min_length=1)
    """Readings that the manual states for the frame, by channel name, in the unit of the channel."""


class _Named(Frozen):
    name: str = Field(pattern=_NAME)
    title: str


class _Emulated(Frozen):
    emulator: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with EmulatorSettings: the device as a model at the far end of `emulated_link`, a
    :class:`tactbench.plugin.devices.DeviceEmulator`, or a SpiDeviceEmulator on SPI."""
    emulated_link: EmulatedLink | None = None
    """Kind of link that the driver uses; required if there is an emulator."""
    emulated_options: dict[str, Scalar | bool] = Field(default_factory=dict)
    """Options of the driver that are found only in the papers of a real device, with values for the emulated device.
    They apply where a rig file omits the options."""
    manual_frame: ManualFrame | None = None
    """A frame of the maker's manual, which the driver must decode as the manual does; None: no frame is given."""


class SensorDescriptor(_Emulated):
    """A sensor, and the import paths of its code."""

    spec: SensorSpec
    transducer: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.simulation.Transducer`; needed for simulation only."""
    driver: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.devices.Driver`, called with DriverSettings; for real devices."""
    log_reader: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with (Path, options): a DeviceLog; for log files of the device's own software."""
    effects: tuple[str, ...] = ()
    """Names of effects, of other packages or of the sensor's own, that every simulation of the sensor considers."""

    @property
    def name(self) -> str:
        """Name of the sensor, from its spec."""
        return self.spec.name


class DeviceDescriptor(_Emulated, _Named):
    """A device other than a tactile sensor, such as a force sensor or a motor, with the import paths of its code."""

    kind: Literal["force", "motor"]
    """Role of the device in a rig. The streams of a force sensor have channels of kind `force`."""
    driver: str = Field(pattern=WHERE)
    """``module:callable`` -> :class:`tactbench.plugin.devices.Driver`, called with DriverSettings; for a motor, the
    object that its rig expects."""


class TaskDescriptor(Frozen):
    """A task, completely described by its spec."""

    spec: TaskSpec

    @property
    def name(self) -> str:
        """Name of the task, from its spec."""
        return self.spec.name


class RigDescriptor(_Named):
    """A rig, and the import paths of its code."""

    where: str = Field(pattern=WHERE)
    """``module:callable``, called with a :class:`tactbench.plugin.RigContext`: a Rig or a ReplayRig."""
    simulated: bool = False
    """True if rows from this rig are marked SIM and are never ranked against hardware."""
    replays: bool = False
    """True if the rig is a ReplayRig; such a rig is used for ``--recordings`` without ``--rig``."""
    references: dict[str, tuple[str, ...]] | None = None
    """Channels of its reference: kinds, each with the names of its channels where these are fixed, to be compared with
    a task's needs before recording; None: not known beforehand."""
    rungs: tuple[str, ...] = ()
    """Names of a simulated rig's solvers in order of cost, the cheapest first."""
    verification: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called without arguments: Verdicts of the simulation against known exact results."""
    work_precision: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with a SensorDescriptor and ``rounds=``, a number of timed recordings: a CostStudy
    of errors against seconds for each recording."""
    file: str | None = Field(default=None, pattern=WHERE)
    """``module:class``, a RigFile that also checks the rig's own settings, so that error messages name their line."""
    check: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with a RigFile: a RigCheck of the rig's actions; no device is opened or moved."""
    emulators: str | None = Field(default=None, pattern=WHERE)
    """``module:callable``, called with a RigFile and a registry: RigEmulators with moving motors, for real time. None:
    emulated devices return the samples of a simulated rig."""


class EstimatorDescriptor(_Named):
    """An estimator, and the import path of its code."""

    kinds: tuple[Literal["regression", "classification", "events"], ...]
    """Kinds of tasks that the estimator solves. For `events`, ``fit`` takes 0 or 1 for each frame (1: it slips) and
    ``predict`` returns a score for each frame; a score at or above a threshold raises an alarm."""
    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(kind=..., seed=..., threads=..., **params)``: an object with
    scikit-learn's ``fit(X, y)`` and ``predict(X)``."""
    params: dict[str, Any] = Field(default_factory=dict)
    """Parameters that a user may set, with their defaults."""
    grid: dict[str, tuple[int | float | str | bool | None, ...]] = Field(default_factory=dict)
    """Candidate values of parameters, to be chosen on validation data; types are kept: 5 is not 5.0."""
    window_grid: tuple[int, ...] = (0,)
    """Candidate values of k for the mean filter over samples t-k … t, chosen together with `grid`."""
    looks_at: Literal["features", "time", "nothing", "reference"] = "features"
    """`time`: X is the time index. `nothing`: X is a column of zeros. `reference`, for events only: X is the tangential
    force over friction times normal force, from the reference sensor: an oracle."""
    summaries: tuple[Summary, ...] = ()
    """Summaries of each channel that the estimator uses for frames, in place of the task's summaries."""
    frames_by: str | None = Field(default=None, pattern=WHERE)
    """``module:callable`` for features of frames in place of summaries, called with (the fastest stream as
    :class:`tactbench.plugin.StreamReadings`, (n,) ends of frames [s], length of a frame [s]): (n, features) numbers of
    the samples up to each end, NaN where there is no answer."""
    threshold: float | None = None
    """Fixed threshold for events; None: the threshold is chosen on validation recordings."""
    baseline: bool = False
    """True if it is a trivial estimator, listed below the results."""
    linear: bool | None = None
    """True if answers (or boundaries between classes) are linear in the features; None: not stated."""
    distributions: tuple[str, ...] = ()
    """Distributions besides tactbench that compute the answers; their versions are part of the key of a cell."""
    rehearsal: dict[str, Any] | None = None
    """Parameters of a short fit before cells are timed, so that no time includes the first use of a library; None: the
    estimator is built but not fitted."""

    @model_validator(mode="after")
    def _nothing_is_searched_of_detectors(self) -> EstimatorDescriptor:
        if "events" in self.kinds and (self.grid or self.window_grid != (0,)):
            raise ValueError("an estimator of kind events takes neither grid nor window_grid")
        return self


class EffectDescriptor(_Named):
    """A physical influence that a simulation may include."""

    where: str = Field(pattern=WHERE)
    """``module:callable``; imported only when a plan includes the effect."""
    produces: tuple[str, ...] = ()
    consumes: tuple[str, ...] = ()
    called_for: str = Field(pattern=WHERE)
    """``module:callable``, called with (Scene, SensorSpec): a Reason, found without heavy computation."""
    groups: tuple[str, ...] = ()
    """Names of groups to which the effect belongs in a scene's ``simulation.effects``: ``drift``, ``noise``."""


class Parameter(Frozen):
    """A parameter of an indenter's shape or of a force profile."""

    default: float
    """Default value, in `unit`, for a scene that gives no value."""
    unit: Unit
    """Unit of the value that is passed to the plugin's code."""
    text: str = Field(pattern=r"^\S[^\n]*$")
    """Description of the parameter in one line."""
    least: float = 0.0
    """Smallest value that may be given, in `unit`."""
    most: float | None = None
    """Largest value that may be given, in `unit`; None: there is no upper limit."""

    @model_validator(mode="after")
    def _default_may_be_given(self) -> Parameter:
        if not self.allows(self.default):
            raise ValueError(f"default: {self.default:g} is given, and the range {self.range} is expected")
        return self

    def allows(self, value: float) -> bool:
        """Return True if `value`, in `unit`, is in the allowed range."""
        return math.isfinite(value) and self.least <= value and (self.most is None or value <= self.most)

    @property
    def range(self) -> str:
        """Allowed values as text: ``0.5 to 3 mm``."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        upper = "" if self.most is None else f" to {self.most:g}"
        return f"{self.least:g}{upper}{unit}{'' if upper else ' or more'}"


def _values(what: str, parameters: Mapping[str, Parameter], given: Mapping[str, Quantity]) -> dict[str, float]:
    """Return the value of each of `parameters` in its own unit, either from `given` or by default.

    Raises UsageError, which begins with `what` (``The indenter 'pin'``), for a name that is not among `parameters`, a
    unit of another dimension, or a value out of range.
    """
    for name in sorted(given.keys() - parameters.keys()):
        known = ", ".join(f"{known} [{one.unit}]" for known, one in parameters.items()) or "no parameters"
        raise UsageError(f"{what}: {name!r} is given, which is not one of its parameters.", hint=f"It has: {known}.")
    values = {}
    for name, parameter in parameters.items():
        try:
            value = given[name].to(parameter.unit) if name in given else parameter.default
        except UsageError as error:
            raise UsageError(f"{what}: {name}: {error.message}", hint=f"Meaning: {parameter.text}") from error
        if not parameter.allows(value):
            raise UsageError(
                f"{what}: {name} is given as {given[name]}, and {parameter.range} is expected.",
                hint=f"Meaning: {parameter.text}",
            )
        values[name] = value
    return values


class IndenterDescriptor(_Named):
    """The shape of an indenter, and the import path of the code for its height."""

    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(x_mm, y_mm, **dimensions)`` with two arrays that broadcast: the height
    of the body above its lowest point [mm], finite everywhere, 0 at (0, 0), 50 mm or more where there is no body."""
    dimensions: dict[str, Parameter] = Field(default_factory=dict)
    """Parameters of the shape by name, each passed as a keyword in its own unit."""

    @model_validator(mode="after")
    def _angle_is_the_scenes(self) -> IndenterDescriptor:
        if "angle" in self.dimensions:
            raise ValueError("dimensions: `angle` is the scene's rotation of the shape; rename this dimension")
        return self

    def sizes(self, given: Mapping[str, Quantity]) -> dict[str, float]:
        """Return every dimension in its unit, from `given` or by default; raise UsageError for a wrong value."""
        return _values(f"The indenter {self.name!r}", self.dimensions, given)


class ProfileDescriptor(_Named):
    """A named profile of the normal force, and the import path of its code."""

    where: str = Field(pattern=WHERE)
    """``module:callable``, called as ``callable(**parameters)``: a :class:`tactbench.plugin.ForcePath`. Scenes
    and recordings contain this path, not the profile's name."""
    parameters: dict[str, Parameter] = Field(default_factory=dict)
    """Parameters of the profile by name, each passed as a keyword in its own unit."""

    def values(self, given: Mapping[str, Quantity]) -> dict[str, float]:
        """Return every parameter in its unit, from `given` or by default; raise UsageError for a wrong value."""
        return _values(f"The profile {self.name!r}", self.parameters, given)

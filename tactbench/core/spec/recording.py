"""The meta of a recording: its sensor, scene, clocks, labels and origin."""

from __future__ import annotations

import unicodedata
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import SensorSpec, StreamSpec

Scalar = str | float | int
"""Value of a label or of another named fact about a recording."""


def composed(text: str) -> str:
    """Return a text in Unicode's form NFC, in which equal words are equal: some disks store é as two characters."""
    return unicodedata.normalize("NFC", text)


_Text = Annotated[str, AfterValidator(composed)]


class PlanEntry(Frozen):
    """An effect of the simulation that was included or left out, with the reason."""

    effect: str
    included: bool
    reason: str
    change: float | None = Field(default=None, allow_inf_nan=True)
    """Change of an observed channel if the effect is left out: an upper bound for one that is left out, an estimate for
    an included one. None: not known without computing it."""
    unit: str = "count"
    """Unit of `change`."""
    asked: bool = False
    """Whether the scene names it."""


class ClockSegment(Frozen):
    """A line between two clocks: host = device + offset + drift (device - middle), with the epochs of both."""

    run: int = 0
    """Number of the run, from 0; within a run the device's times neither go back nor jump by more than 15 s."""
    middle_ns: int
    """Time of the device in the middle of the stretch that the line was fitted to."""
    offset_ns: int
    """Time of the host minus that of the device, at `middle_ns`."""
    drift: float
    """Rate by which the host's clock runs faster than the device's [s/s]."""
    bound_ns: int | None
    """Bound of the line's error within its stretch, without the constant part of the delay, if delays sometimes come
    near their least value (two-way: for any delays). None: too few points."""
    points: int
    """Number of pairs of times that the line was fitted to; samples that came together count once."""


class StreamClock(Frozen):
    """Origin of the times of one stream."""

    source: Literal["device", "host", "simulated"]
    """`device`: the device's clock, mapped to the host's by `segments`. `host`: when the sample was received or
    requested. `simulated`: the virtual time of emulated devices."""
    method: Literal["none", "hull-1way", "hull-2way"] = "none"
    """Method by which the device's clock was mapped to the host's."""
    delay_ns: tuple[int, int] = (0, 0)
    """Range of the least delay of a sample to the host, which one-way fits neither measure nor remove."""
    segments: tuple[ClockSegment, ...] = ()
    """Lines in order; between the middles of two in one run, one is blended into the other."""
    wraps: int = 0
    """Number of times that the device's counter began anew."""
    breaks: int = 0
    """Number of times that the count was lost and the device's time went back."""


class StreamCounts(Frozen):
    """Counts of the rows of one stream: received = written + dropped + duplicates + late."""

    received: int = 0
    written: int = 0
    dropped: int = 0
    """Rows that were lost between reading and writing, because writing was behind."""
    duplicates: int = 0
    """Rows that were left out because their number had come before."""
    late: int = 0
    """Rows that were left out because they came after rows that follow them."""
    gaps: int = 0
    """Rows that were missing where they were due, by the device's numbers, with those that came late."""


class Emulation(Frozen):
    """How devices of a recording were emulated."""

    time: Literal["virtual", "real"]
    factor: float | None = None
    """Seconds of the devices for each second of the wall clock; None: not measured."""
    seed: int = 0
    physics: str = ""
    """Name of the simulated rig whose samples moved them."""
    devices: tuple[str, ...] = ()
    """Names of the emulated devices; the others were real."""
    faults: tuple[str, ...] = ()
    """Faults of the emulated devices, as the rig file writes them: ``device: fault``."""


class RecordingMeta(Frozen):
    """The meta of one recording, which is written once and never changed."""

    name: str
    """Name of the recording, unique in its folder and fit for a file name."""
    sensor: SensorSpec
    """The whole specification of the sensor, so that the file can be read without the plugin."""
    reference: tuple[StreamSpec, ...] = ()
    """Streams of other devices than the sensor, such as the force-torque sensor."""
    rig: str
    simulated: bool = False
    own_rates_hz: dict[str, float] = Field(default_factory=dict)
    """Rate at which the sensor itself samples a stream that the recording has at another rate [Hz], by stream."""
    emulation: Emulation | None = None
    """How devices were emulated, in which case `simulated` is true; None: no device was."""
    clock: Literal["device", "host", "simulated", "nominal", "none"] = "device"
    """Origin of the times: the device, the host that read it, the simulation, row number by nominal rate, or none."""
    clocks: dict[str, StreamClock] = Field(default_factory=dict)
    """Clocks of streams with a clock of their own; their `t_ns` are on the host's clock."""
    streams: dict[str, StreamCounts] = Field(default_factory=dict)
    """Counts of the rows of streams that came from devices."""
    session: _Text = "1"
    trial: _Text = ""
    role: Role | None = None
    scene: Scene | None = None
    labels: dict[_Text, _Text | float | int] = Field(default_factory=dict)
    """Labels of the whole recording: object, cap radius …"""
    excluded: str = ""
    """Reason for which no evaluation uses the recording; empty: it is used."""
    remarks: tuple[str, ...] = ()
    """Sentences that are shown with every score from the recording."""
    plan: tuple[PlanEntry, ...] = ()
    assumptions: dict[str, Scalar] = Field(default_factory=dict)
    """Assumed parameters that decide the result, shown with every simulated row."""
    drawn: dict[str, Scalar] = Field(default_factory=dict)
    """Numbers that the rig drew or achieved: placement, error bound of the load table …"""
    seed: int | None = None
    origin: str = ""
    """Files that the recording was imported from, without the folders above the data set."""
    counts: dict[str, int] = Field(default_factory=dict)
    """Counts of the recording: rows read, samples marked as missing …"""
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Versions, time of creation and cost; they are no part of the content digest."""

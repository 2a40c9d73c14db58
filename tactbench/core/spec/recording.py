"""Metadata of a recording: its sensor, scene, clocks, labels and origin."""

from __future__ import annotations

import unicodedata
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import SensorSpec, StreamSpec

Scalar = str | float | int
"""Value of a label, or of another named fact about a recording."""
INCOMPLETE = "incomplete: "
"""Beginning of the text in the meta's field `excluded` of an incomplete recording."""


def composed(text: str) -> str:
    """Return a text in Unicode's form NFC, so that equal words compare equal: some disks store é as two characters."""
    return unicodedata.normalize("NFC", text)


_Text = Annotated[str, AfterValidator(composed)]


class PlanEntry(Frozen):
    """An effect of the simulation that was included or left out, and the reason."""

    effect: str
    included: bool
    reason: str
    change: float | None = Field(default=None, allow_inf_nan=True)
    """Change of an observed channel if the effect is left out: an upper bound for an effect that was left out, an
    estimate for an included effect. None: not known without computing the effect."""
    unit: str = "count"
    """Unit of `change`, as text."""
    asked: bool = False
    """True if the scene names the effect."""


class ClockSegment(Frozen):
    """A linear relation of two clocks: host = device + offset + drift (device - middle), with the epochs of both."""

    run: int = 0
    """Number of the run, from 0. Within a run, the device's times neither go back nor jump by more than 15 s."""
    middle_ns: int
    """Time of the device in the middle of the fitted stretch."""
    offset_ns: int
    """Time of the host minus the time of the device, at `middle_ns`."""
    drift: float
    """Relative rate by which the host's clock is faster than the device's clock [s/s]."""
    bound_ns: int | None
    """Bound of the line's error within its stretch, without the constant part of the delay, if some delays are near the
    least delay (two-way: for any delays). None: there are too few points."""
    points: int
    """Number of pairs of times in the fit; samples that arrived together count once."""


class StreamClock(Frozen):
    """Origin of the times of one stream, with the mapping between its clocks."""

    source: Literal["device", "host", "simulated"]
    """`device`: the device's clock, mapped to the host's clock by `segments`. `host`: the time of receiving or of
    requesting the sample. `simulated`: the virtual time of emulated devices."""
    method: Literal["none", "hull-1way", "hull-2way"] = "none"
    """Method by which the device's clock was mapped to the host's."""
    delay_ns: tuple[int, int] = (0, 0)
    """Range of the least delay from sampling to the host, which one-way fits neither measure nor remove."""
    segments: tuple[ClockSegment, ...] = ()
    """Linear pieces of the mapping in order of time; between the middles of two pieces of one run, they are blended."""
    wraps: int = 0
    """Number of times that the device's counter restarted at its smallest value."""
    breaks: int = 0
    """Number of times that the count was lost, so that the device's time went back."""


class StreamCounts(Frozen):
    """Row counts of one stream: received = written + dropped + duplicates + late."""

    received: int = 0
    written: int = 0
    dropped: int = 0
    """Number of rows that were lost between reading and writing, because writing was too slow."""
    duplicates: int = 0
    """Number of rows left out as duplicates: their number had been received before."""
    late: int = 0
    """Number of rows left out because they arrived after rows with higher numbers."""
    gaps: int = 0
    """Number of rows missing in their order by the device's numbers, including rows that arrived late."""


class Emulation(Frozen):
    """Description of a recording's emulated devices."""

    time: Literal["virtual", "real"]
    factor: float | None = None
    """Seconds of the devices' time for each second of real time; None: not measured."""
    seed: int = 0
    physics: str = ""
    """Name of the simulated rig whose samples the emulated devices return."""
    devices: tuple[str, ...] = ()
    """Names of the emulated devices; all others were real."""
    faults: tuple[str, ...] = ()
    """Faults of the emulated devices, as the rig file gives them: ``device: fault``."""


class RecordingMeta(Frozen):
    """Metadata of one recording, written once and never changed."""

    name: str
    """Name of the recording, unique in its folder and valid as a file name."""
    sensor: SensorSpec
    """The whole specification of the sensor, so that the file can be read without the plugin."""
    reference: tuple[StreamSpec, ...] = ()
    """Streams of devices other than the sensor, such as the force-torque sensor."""
    rig: str
    simulated: bool = False
    own_rates_hz: dict[str, float] = Field(default_factory=dict)
    """The sensor's own sample rate [Hz], by stream, for streams whose rate in the recording differs from it."""
    emulation: Emulation | None = None
    """Description of the emulation, with which `simulated` is true; None: no device was emulated."""
    clock: Literal["device", "host", "simulated", "nominal", "none"] = "device"
    """Origin of the times: the device, the host that read it, the simulation, row number by nominal rate, or none."""
    clocks: dict[str, StreamClock] = Field(default_factory=dict)
    """Clocks of the streams whose device has its own clock; their `t_ns` are on the host's clock."""
    streams: dict[str, StreamCounts] = Field(default_factory=dict)
    """Row counts of the streams that came from devices."""
    session: _Text = "1"
    trial: _Text = ""
    role: Role | None = None
    scene: Scene | None = None
    labels: dict[_Text, _Text | float | int] = Field(default_factory=dict)
    """Labels of the whole recording by name: object, cap radius …"""
    excluded: str = ""
    """Reason for excluding the recording from every evaluation; empty: it is used."""
    remarks: tuple[str, ...] = ()
    """Sentences to be shown with every score from the recording."""
    plan: tuple[PlanEntry, ...] = ()
    assumptions: dict[str, Scalar] = Field(default_factory=dict)
    """Assumed parameters that strongly affect the result, shown with every simulated row."""
    drawn: dict[str, Scalar] = Field(default_factory=dict)
    """Values that the rig drew at random or achieved, by name: placement, error bound of the load table …"""
    seed: int | None = None
    origin: str = ""
    """Source files of an imported recording, as paths within the data set."""
    counts: dict[str, int] = Field(default_factory=dict)
    """Counts from recording or import, by name: rows read, samples marked as missing …"""
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Versions, time of creation and computing time; they are not part of the content digest."""

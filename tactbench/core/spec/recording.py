"""What a recording says about itself."""

from __future__ import annotations

import unicodedata
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import SensorSpec, StreamSpec

Scalar = str | float | int
"""What a recording says of itself under a name."""


def composed(text: str) -> str:
    """Return a text in Unicode's form NFC, in which equal words are equal texts: some disks write an é as two signs."""
    return unicodedata.normalize("NFC", text)


_Text = Annotated[str, AfterValidator(composed)]


class PlanEntry(Frozen):
    """One effect of the twin, chosen or left out, and why."""

    effect: str
    included: bool
    reason: str
    change: float | None = Field(default=None, allow_inf_nan=True)
    """What leaving it out changes in an observed channel: at most, for an effect left out (0: exactly nothing); about,
    for an included one. None: nobody can say without computing it."""
    unit: str = "count"
    """Unit of `change`."""
    asked: bool = False
    """Included or left out because the scene asked for it by name."""


class ClockSegment(Frozen):
    """host = device + offset + drift (device - middle), all since 1970 or whatever the two clocks count from."""

    run: int = 0
    """Which of the runs in which the device's times neither go back nor leap by more than 15 s, from 0."""
    middle_ns: int
    """Where on the device's clock the line is given: the middle of the stretch it was fitted to."""
    offset_ns: int
    """Host's clock minus device's at `middle_ns`."""
    drift: float
    """By how much the host's clock runs faster than the device's [s/s]."""
    bound_ns: int | None
    """The line's error within its stretch is at most this, if delays sometimes come near their least value (two-way:
    whatever the delays are); the constant part of the delay comes on top. None: too few points to tell."""
    points: int
    """Pairs of stamps it was fitted to: of samples that came together, one."""


class StreamClock(Frozen):
    """Where the times of one stream come from."""

    source: Literal["device", "host", "simulated"]
    """`device`: its own clock, put on the host's by `segments`. `host`: the host's, when the sample came, or was asked
    for. `simulated`: the virtual time of emulated devices."""
    method: Literal["none", "hull-1way", "hull-2way"] = "none"
    """How the device's clock was put on the host's."""
    delay_ns: tuple[int, int] = (0, 0)
    """From and to: what the sample's way to the host takes at least; it cannot be seen one way and is not taken off."""
    segments: tuple[ClockSegment, ...] = ()
    """In order; between two middles of one run, times go over from one line to the next."""
    wraps: int = 0
    """How often the device's counter began anew."""
    breaks: int = 0
    """How often it was lost, so that the device's time went back."""


class StreamCounts(Frozen):
    """What became of the rows of one stream: received = written + dropped + duplicates + late."""

    received: int = 0
    written: int = 0
    dropped: int = 0
    """Lost between reading and writing, because writing was behind."""
    duplicates: int = 0
    """Kept out: their number had come before."""
    late: int = 0
    """Kept out: they came after rows that follow them."""
    gaps: int = 0
    """Rows missing where they were due, by the device's own numbers; those that came late are among them."""


class Emulation(Frozen):
    """That devices were emulated, and how."""

    time: Literal["virtual", "real"]
    factor: float | None = None
    """Seconds of the devices for one of the wall clock; None: not measured."""
    seed: int = 0
    physics: str = ""
    """The simulated rig whose samples moved them."""
    devices: tuple[str, ...] = ()
    """Which ones; the others were real."""
    faults: tuple[str, ...] = ()
    """``device: fault``, as the rig file writes them."""


class RecordingMeta(Frozen):
    """The attributes of one recording: written once, never changed."""

    name: str
    """Fit for a file name, unique in its folder."""
    sensor: SensorSpec
    """The whole spec, so that the file explains itself without the plugin."""
    reference: tuple[StreamSpec, ...] = ()
    """Streams that are not the sensor's own: the force-torque sensor, for example."""
    rig: str
    simulated: bool = False
    own_rates_hz: dict[str, float] = Field(default_factory=dict)
    """By stream: the rate at which the sensor itself samples it, where the recording has it at another [Hz]."""
    emulation: Emulation | None = None
    """None: no device was emulated. Otherwise `simulated` is true as well: what they sense is computed."""
    clock: Literal["device", "host", "simulated", "nominal", "none"] = "device"
    """Who made the time stamps: the device, the host that read it, the simulation, `row / rate`, or nobody (row order
    only)."""
    clocks: dict[str, StreamClock] = Field(default_factory=dict)
    """By stream, where streams have clocks of their own; their `t_ns` are then on the host's."""
    streams: dict[str, StreamCounts] = Field(default_factory=dict)
    """By stream: what became of its rows, where they came from devices."""
    session: _Text = "1"
    trial: _Text = ""
    role: Role | None = None
    scene: Scene | None = None
    labels: dict[_Text, _Text | float | int] = Field(default_factory=dict)
    """What holds for the whole recording: object, cap radius …"""
    excluded: str = ""
    """Why this recording must not be evaluated (its source calls it unreliable); empty: it may."""
    remarks: tuple[str, ...] = ()
    """What a reader of a score from this recording must know."""
    plan: tuple[PlanEntry, ...] = ()
    assumptions: dict[str, Scalar] = Field(default_factory=dict)
    """Assumed parameters that decide the result; printed with every simulated row."""
    drawn: dict[str, Scalar] = Field(default_factory=dict)
    """What the rig drew or achieved: placement, error bound of the load table …"""
    seed: int | None = None
    origin: str = ""
    """Files a foreign recording was imported from, without folders above the data set."""
    counts: dict[str, int] = Field(default_factory=dict)
    """What was counted on the way in: rows read, samples marked as missing …"""
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Versions, creation time, cost; not part of the content digest."""

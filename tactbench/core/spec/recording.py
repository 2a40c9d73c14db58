"""What a recording says about itself."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.scene import Role, Scene
from tactbench.core.spec.sensor import SensorSpec, StreamSpec

Scalar = str | float | int


class PlanEntry(Frozen):
    """One effect of the twin, chosen or left out, and why."""

    effect: str
    included: bool
    reason: str
    change: float | None = None
    """What leaving it out changes in an observed channel: at most, for an effect left out (0: exactly nothing); about,
    for an included one. None: nobody can say without computing it."""
    unit: str = "count"
    """Unit of `change`."""
    asked: bool = False
    """Included or left out because the scene asked for it by name."""


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
    clock: Literal["device", "host", "nominal", "none"] = "device"
    """Who made the time stamps: the device, the host that read it, `row / rate`, or nobody (row order only)."""
    session: str = "1"
    trial: str = ""
    role: Role | None = None
    scene: Scene | None = None
    labels: dict[str, Scalar] = Field(default_factory=dict)
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

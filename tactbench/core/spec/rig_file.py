"""A rig file: which devices stand on which links, for rigs of real devices and for their emulators."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.recording import Scalar

FORCE = "force"
"""Name of the force sensor's entry among the devices."""
EMULATED = "emulated"
"""Stands for a link's address where the device's emulator is to be started."""


class DeviceEntry(Frozen):
    """One device."""

    link: str = Field(min_length=1)
    """Address of its link (``docs/links.md``), or ``emulated``."""
    options: dict[str, Scalar | bool] = Field(default_factory=dict)
    """What its driver needs to know beside the link."""
    faults: tuple[str, ...] = ()
    """Faults of its emulator: ``name`` or ``name:key=value,…``."""
    emulator: bool = False
    """Whether an emulator that runs already is at the far end of `link`: what is recorded is then marked EMULATED."""

    @property
    def emulated(self) -> bool:
        """Whether its emulator is to be started."""
        return self.link == EMULATED

    @model_validator(mode="after")
    def _faults_of_emulators(self) -> DeviceEntry:
        if self.faults and not self.emulated:
            raise ValueError("only an emulated device has faults to choose; use link: emulated, or leave them out")
        return self


class ForceEntry(DeviceEntry):
    """The reference force sensor."""

    device: str
    """Name of the device (``tactbench list devices``)."""
    channel: str = "fz"
    """Its channel along which the sensor is pressed."""
    sign: Literal[-1, 1] = 1
    """-1: pressing makes that channel fall."""
    zero_s: float = Field(default=2.0, ge=0)
    """Seconds without load before each scene whose mean becomes zero on every channel; 0: the device keeps its own."""
    range_n: float = Field(default=25.0, gt=0)
    """Rated range of its forces; by default that of a Nano17 SI-25-0.25. A zero of more than a tenth of it is refused,
    and while it is taken a spread of more than a twentieth and a drift of more than a hundredth."""
    noise_n: float | None = Field(default=None, gt=0)
    """Standard deviation of its forces without load; a spread of twice that is refused. None: not known."""
    largest_zero_n: float | None = Field(default=None, gt=0)
    """In place of a tenth of the range: for a heavy indenter, or a sensor that was never biased."""


class Allowed(Frozen):
    """What a recording may lack; one that lacks more is incomplete, and takes no part in a score unless asked for."""

    silent_s: float = Field(default=2.0, gt=0)
    """Longest time without a row of a stream that has a rate. A longer one ends the scene."""
    lost_percent: float = Field(default=2.0, ge=0, le=100)
    """Rows of a stream that never came, or were dropped since writing was behind."""
    frozen_s: float = Field(default=2.0, gt=0)
    """Longest time in which no channel of the force sensor changes, though most of its other rows differ from the one
    before; or of the sensor, while the force does. A force that never changes while the sensor does is frozen, too."""


class NamedDevice(DeviceEntry):
    """A further device, such as a motor."""

    device: str
    """Name of the device (``tactbench list devices``)."""


class EmulationSettings(Frozen):
    """How the emulated devices of a rig are moved."""

    time: Literal["virtual", "real"] = "virtual"
    """`virtual`: as fast as it can be computed, the same each time; `real`: by the wall clock."""
    physics: str = ""
    """The simulated rig whose samples the emulated devices read; empty: the one that comes with tactbench."""
    seed: int = Field(default=1, ge=0)
    """Of what is drawn in emulators; the scene's own seed is the run's."""
    control: str = ""
    """``host:port`` of emulators that run already (`tactbench emulate` writes it): a recording tells them its scene."""


class RigFile(Frozen):
    """What a rig of real devices is made of."""

    version: Literal[1] = 1
    rig: str
    """Name of the rig (``tactbench list rigs``) that the file is for."""
    title: str = ""
    """Shown with its recordings."""
    sensors: dict[str, DeviceEntry] = Field(min_length=1)
    """By the sensor's name; a run uses the one it asks for."""
    force: ForceEntry | None = None
    devices: dict[str, NamedDevice] = Field(default_factory=dict)
    """Further devices by their part in the rig, such as `motor`."""
    emulation: EmulationSettings = EmulationSettings()
    allowed: Allowed = Allowed()
    settings: dict[str, Any] = Field(default_factory=dict)
    """The rig's own, which it checks itself."""

    @property
    def emulated(self) -> bool:
        """Whether any device is emulated."""
        return any(entry.emulated for entry in self.entries().values())

    def checked_for(self, rig: str) -> RigFile:
        """Return this file; raise UsageError if it is for another rig."""
        if self.rig != rig:
            raise UsageError(
                f"The rig file is for the rig {self.rig!r}, asked for is {rig!r}.",
                hint=f"Use --rig {self.rig}, or another rig file.",
            )
        return self

    def checked_for_one_clock(self) -> RigFile:
        """Return this file; raise UsageError if emulated devices are to run in virtual time beside real ones."""
        real = [name for name, entry in self.entries().items() if not entry.emulated]
        if self.emulated and real and self.emulation.time == "virtual":
            raise UsageError(
                f"{', '.join(real)} is a real device and runs by the clock, the emulated ones in virtual time.",
                hint="Write `time: real` under `emulation:`.",
            )
        return self

    def entries(self) -> dict[str, DeviceEntry]:
        """Return every device by its name in messages: the sensor's name, ``force``, or its part in the rig."""
        found: dict[str, DeviceEntry] = dict(self.sensors)
        if self.force is not None:
            found[FORCE] = self.force
        return found | self.devices

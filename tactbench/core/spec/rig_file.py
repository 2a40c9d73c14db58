"""Model of a rig file: the devices of a rig, real or emulated, and their links."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.recording import Scalar

FORCE = "force"
"""Name of the force sensor's entry among the devices."""
EMULATED = "emulated"
"""Address of a link whose device is to be emulated."""


class DeviceEntry(Frozen):
    """A device of a rig."""

    link: str = Field(min_length=1)
    """Address of its link (``docs/links.md``), or ``emulated``."""
    options: dict[str, Scalar | bool] = Field(default_factory=dict)
    """Options of its driver."""
    faults: tuple[str, ...] = ()
    """Faults of its emulator: ``name`` or ``name:key=value,…``."""
    emulator: bool = False
    """Whether the far end of `link` is an emulator that runs already: its recordings are marked EMULATED."""

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
    """Channel along which the sensor is pressed."""
    sign: Literal[-1, 1] = 1
    """Sign of the change of that channel when the sensor is pressed."""
    zero_s: float = Field(default=2.0, ge=0)
    """Seconds without load before each scene, whose mean becomes zero on every channel; 0: the device's own zero is
    kept."""
    range_n: float = Field(default=25.0, gt=0)
    """Rated range of its forces [N], by default that of a Nano17 SI-25-0.25. While the zero is taken, a mean above a
    tenth of it is refused, and so are a spread above a twentieth and a drift above a hundredth."""
    noise_n: float | None = Field(default=None, gt=0)
    """Standard deviation of its forces without load [N]; a spread of twice that is refused. None: not known."""
    largest_zero_n: float | None = Field(default=None, gt=0)
    """Largest zero [N] in place of a tenth of the range, for a heavy indenter or a sensor that was never biased."""


class Allowed(Frozen):
    """Limits of what a recording may lack; one that lacks more takes no part in a score by default."""

    silent_s: float = Field(default=2.0, gt=0)
    """Longest time without a row of a stream that has a rate; a longer one ends the scene."""
    lost_percent: float = Field(default=2.0, ge=0, le=100)
    """Largest share of the rows of a stream that never came, or were dropped because writing was behind [%]."""
    frozen_s: float = Field(default=2.0, gt=0)
    """Longest time in which no channel of the force sensor changes, though most of its other rows differ from the one
    before, or none of the sensor while the force does. A force that never changes while the sensor does is frozen
    too."""


class NamedDevice(DeviceEntry):
    """A further device, such as a motor."""

    device: str
    """Name of the device (``tactbench list devices``)."""


class EmulationSettings(Frozen):
    """Settings of the emulation of a rig's devices."""

    physics: str = ""
    """Name of the simulated rig whose samples the devices read; empty: the one that comes with tactbench."""
    seed: int = Field(default=1, ge=0)
    """Seed of what emulators draw; a run has a seed of its own for the scene."""
    control: str = ""
    """Address ``host:port`` of emulators that run already, to which each scene is sent; `tactbench emulate` writes
    it."""


class RigFile(Frozen):
    """The devices and the settings of a rig."""

    version: Literal[1] = 1
    rig: str
    """Name of the rig (``tactbench list rigs``) that the file is for."""
    title: str = ""
    """Title, which is shown with recordings."""
    sensors: dict[str, DeviceEntry] = Field(min_length=1)
    """Sensors by their names, of which a run uses one or several."""
    force: ForceEntry | None = None
    devices: dict[str, NamedDevice] = Field(default_factory=dict)
    """Further devices by their part in the rig, such as `motor`."""
    emulation: EmulationSettings = EmulationSettings()
    allowed: Allowed = Allowed()
    settings: dict[str, Any] = Field(default_factory=dict)
    """Settings of the rig, which it checks itself."""

    @property
    def emulated(self) -> bool:
        """Whether any device is emulated."""
        return any(entry.emulated for entry in self.entries().values())

    def checked_for(self, rig: str) -> RigFile:
        """Return this file; raise UsageError if it is for another rig."""
        if self.rig != rig:
            raise UsageError(
                f"The rig file is for the rig {self.rig!r}, and the rig {rig!r} is given.",
                hint=f"Use --rig {self.rig}, or another rig file.",
            )
        return self

    def checked_for_one_clock(self) -> RigFile:
        """Return this file; raise UsageError if emulated devices, in virtual time, stand beside real ones."""
        real = [name for name, entry in self.entries().items() if not entry.emulated]
        if self.emulated and real:
            raise UsageError(
                f"{', '.join(real)} is a real device and runs by the clock, the emulated ones in virtual time.",
                hint="Use the rig file that `tactbench emulate --rig-file FILE` prints.",
            )
        return self

    def entries(self) -> dict[str, DeviceEntry]:
        """Return every device by its name in messages: that of the sensor, ``force``, or the part in the rig."""
        found: dict[str, DeviceEntry] = dict(self.sensors)
        if self.force is not None:
            found[FORCE] = self.force
        return found | self.devices

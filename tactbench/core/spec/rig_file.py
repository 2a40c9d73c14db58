"""Model of a rig file, which lists the devices of a rig, real or emulated, and their links."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from tactbench.core.errors import UsageError
from tactbench.core.spec.quantity import Frozen
from tactbench.core.spec.recording import Scalar

FORCE = "force"
"""Name in the list of devices under which the force sensor stands."""
EMULATED = "emulated"
"""Address that stands in place of a link if the device is to be emulated."""


class DeviceEntry(Frozen):
    """A device of a rig, with its link and options."""

    link: str = Field(min_length=1)
    """Address of the device's link (``docs/links.md``), or ``emulated``."""
    options: dict[str, Scalar | bool] = Field(default_factory=dict)
    """Options of the device's driver."""
    faults: tuple[str, ...] = ()
    """Faults of the device's emulator, each ``name`` or ``name:key=value,…``."""
    emulator: bool = False
    """True if the other end of `link` is a running emulator, so that recordings are marked EMULATED."""

    @property
    def emulated(self) -> bool:
        """True if an emulator of the device is to be started."""
        return self.link == EMULATED

    @model_validator(mode="after")
    def _faults_of_emulators(self) -> DeviceEntry:
        if self.faults and not self.emulated:
            raise ValueError("faults are allowed only for an emulated device (link: emulated)")
        return self


class NamedDevice(DeviceEntry):
    """A device other than the sensor, for example a motor."""

    device: str
    """Name of the device (``tactbench list devices``)."""


class ForceEntry(NamedDevice):
    """The force sensor that measures the reference."""

    channel: str = "fz"
    """Name of the force channel along whose axis the sensor is pressed."""
    sign: Literal[-1, 1] = 1
    """Sign of the change of `channel` when the sensor is pressed."""
    zero_s: float = Field(default=2.0, ge=0)
    """Seconds without load before each scene over which every channel is zeroed; 0: the device's own zero is kept."""
    range_n: float = Field(default=25.0, gt=0)
    """Rated range of the force sensor [N], by default the range of a Nano17 SI-25-0.25. Zeroing is refused for a mean
    above a tenth of it, a spread above a twentieth, or a drift above a hundredth."""
    noise_n: float | None = Field(default=None, gt=0)
    """Standard deviation of the unloaded forces [N]; zeroing is refused above twice this value. None: unknown."""
    largest_zero_n: float | None = Field(default=None, gt=0)
    """Largest zero force [N], in place of a tenth of the range, for a heavy indenter or a sensor never tared."""


class Allowed(Frozen):
    """Limits of missing data; a recording beyond a limit is incomplete and by default not used for scores."""

    silent_s: float = Field(default=2.0, gt=0)
    """Longest time without a row of a stream that has a rate [s]; a longer gap ends the scene."""
    lost_percent: float = Field(default=2.0, ge=0, le=100)
    """Largest share of a stream's rows that may be missing, or were dropped because writing was too slow [%]."""
    frozen_s: float = Field(default=2.0, gt=0)
    """Longest time [s] in which no force channel changes, though most of its other rows differ from the last, or no
    channel of the sensor, though the force does; also a force that never changes, though the sensor does."""


class EmulationSettings(Frozen):
    """Settings for emulating a rig's devices."""

    physics: str = ""
    """Name of the simulated rig whose samples the devices return; empty: the simulated rig of tactbench."""
    seed: int = Field(default=1, ge=0)
    """Seed of the emulators; the scene uses the seed of the run."""
    control: str = ""
    """Address ``host:port`` of running emulators, to which each scene is sent; `tactbench emulate` writes it."""


class RigFile(Frozen):
    """The devices of a rig, and its settings."""

    version: Literal[1] = 1
    rig: str
    """Name of the rig (``tactbench list rigs``) for which the file is written."""
    title: str = ""
    """Title of the rig, shown with recordings."""
    sensors: dict[str, DeviceEntry] = Field(min_length=1)
    """Sensors by name, one or several of which a run uses."""
    force: ForceEntry | None = None
    devices: dict[str, NamedDevice] = Field(default_factory=dict)
    """Further devices by their role in the rig, such as `motor`."""
    emulation: EmulationSettings = EmulationSettings()
    allowed: Allowed = Allowed()
    settings: dict[str, Any] = Field(default_factory=dict)
    """Settings of the rig, checked by its own model."""

    @property
    def emulated(self) -> bool:
        """True if any of the devices is emulated."""
        return any(entry.emulated for entry in self.entries().values())

    def checked_for(self, rig: str) -> RigFile:
        """Return this file unchanged; raise UsageError if it was written for another rig."""
        if self.rig != rig:
            raise UsageError(
                f"The rig file is for the rig {self.rig!r}, and the rig {rig!r} is given.",
                hint=f"Use --rig {self.rig}, or another rig file.",
            )
        return self

    def checked_for_one_clock(self) -> RigFile:
        """Return this file unchanged; raise UsageError if emulated devices, in virtual time, stand beside real ones."""
        real = [name for name, entry in self.entries().items() if not entry.emulated]
        if self.emulated and real:
            raise UsageError(
                f"{', '.join(real)} is a real device in real time, but other devices are emulated in virtual time.",
                hint="Use the rig file that `tactbench emulate --rig-file FILE` prints.",
            )
        return self

    def entries(self) -> dict[str, DeviceEntry]:
        """Return every device by its name in messages: the sensor's name, ``force``, or the role in the rig."""
        found: dict[str, DeviceEntry] = dict(self.sensors)
        if self.force is not None:
            found[FORCE] = self.force
        return found | self.devices

"""What a driver is: one device behind one link, read in blocks; and its options."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self, TypeVar

from pydantic import BaseModel, ConfigDict

from tactbench.core.errors import TactbenchError, UsageError, error_text
from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec
from tactbench.links.address import read_options
from tactbench.links.link import Clock, Link


@dataclass(frozen=True)
class DriverSettings:
    """What a driver is built from."""

    open_link: Callable[[], Link]
    """Opens the link that the rig file names, or the emulator's."""
    streams: tuple[StreamSpec, ...] = ()
    """Streams of the sensor's spec; empty for a device that is no sensor."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """What the rig file says of this device beside its link; the driver refuses what it does not know."""
    clock: Clock = time.monotonic_ns
    """The host's clock, the same as the link's; virtual where time is virtual."""


class Options(BaseModel):
    """Options of one device, the same for its driver and its emulator, or settings of a rig: known and finite ones."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Driver(ABC):
    """One device: open once it is made, until :meth:`close` or the end of its ``with`` block.

    One thread uses a driver. Its only waits are its link's, so that it runs in virtual time as in real time.

    What is wrong with single samples is in their blocks' quality and in :attr:`counts`, and raises nothing; what ends
    the reading raises: :class:`~tactbench.core.errors.LinkUnplugged` of the link, or a RigError of the device.

    Raises
    ------
    UsageError
        For options that are not known or contradict each other, or a link of another kind.
    LinkError
        If the link does not open.
    """

    device: ClassVar[str] = ""
    """Name in messages; empty: that of the class."""
    link_kind: ClassVar[type[Link]]
    """Of the link that is opened; and an example of its address."""
    address: ClassVar[str] = "those of docs/links.md"
    options_kind: ClassVar[type[Options]] = Options
    """What a rig file's entry may say."""

    def __init__(self, settings: DriverSettings) -> None:
        device = self.device or type(self).__name__
        self.clock = settings.clock
        """Nanoseconds of the host."""
        self.options: Any = read_options(self.options_kind, settings.options, device)
        self.link: Any = open_for(settings, device, self.link_kind, self.address)

    @property
    @abstractmethod
    def streams(self) -> tuple[StreamSpec, ...]:
        """What it reads, as it is set up now; rates as far as they are known."""

    @property
    def counts(self) -> Mapping[str, int]:
        """What was counted since it was opened, by name: parity errors, frames lost … An empty one: all was well."""
        return {}

    def identify(self) -> Mapping[str, str]:
        """Return what the device says of itself (model, serial, firmware), to be asked before :meth:`start`.

        Raises
        ------
        LinkTimeout, LinkUnplugged, RigError
            If it does not answer, or is another device.
        """
        return {}

    @abstractmethod
    def start(self) -> None:
        """Set the device up and let it sample; raises as :meth:`identify`.

        What it sent before is discarded (:meth:`~tactbench.links.link.Link.discard`): the first row is of the first
        whole frame after this call.
        """

    @abstractmethod
    def read(self, timeout_s: float) -> list[Block]:
        """Return what has come since the last call, a block a stream that has any.

        Parameters
        ----------
        timeout_s
            Seconds to wait for the first; 0 asks without waiting. An empty list: nothing came, which is no error.

        Returns
        -------
        list of Block
            ``t_ns`` on the host's clock, as well as the driver knows it when the sample comes: of a device with a
            counter the time of receipt. ``device_ns`` where the device has a clock of its own, counted on over its
            wraps. ``sequence`` where it numbers its samples: counted on over its wraps, too.
        """

    @abstractmethod
    def stop(self) -> None:
        """Let the device stop sampling; what is still under way is dropped. Raises nothing if it is gone."""

    def tare(self) -> bool:
        """Let the device take its present reading as zero; return whether it can do so itself."""
        return False

    def close(self) -> None:
        """Stop if it is sampling, and close the link; once closed, this does nothing."""
        self.stop()
        self.link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def fault_text(error: Exception) -> str:
    """Return what an error says within a sentence: without its next step and its full stop."""
    return (error.message if isinstance(error, TactbenchError) else error_text(error)).rstrip(".")


_Link = TypeVar("_Link", bound=Link)


def open_for(settings: DriverSettings, device: str, kind: type[_Link], example: str) -> _Link:
    """Return the open link of a driver; raises UsageError if it is of another kind, LinkError if it does not open."""
    link = settings.open_link()
    if not isinstance(link, kind):
        link.close()
        raise UsageError(f"{device} cannot be spoken to through {link.address}.", hint=f"Use a link like {example}.")
    return link

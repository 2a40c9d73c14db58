"""Driver of one device behind one link, which is read in blocks; and its options."""

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
    """Arguments of a driver."""

    open_link: Callable[[], Link]
    """Function that opens the link of the rig file, or of the emulator."""
    streams: tuple[StreamSpec, ...] = ()
    """Streams of the sensor's spec; empty for a device that is no sensor."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the device in the rig file; the driver refuses unknown ones."""
    clock: Clock = time.monotonic_ns
    """The host's clock, the same as the link's; virtual where time is virtual."""


class Options(BaseModel):
    """Model of the options of a device, for its driver and its emulator, or of a rig's settings: known, finite ones."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Driver(ABC):
    """Driver of one device: open once it is made, until :meth:`close` or the end of its ``with`` block.

    One thread uses a driver. It waits in its link alone, so that it runs in virtual time as in real time.

    Bad samples raise nothing: they are marked in the blocks' quality and counted in :attr:`counts`. An error ends the
    reading: :class:`~tactbench.core.errors.LinkUnplugged` of the link, or a RigError of the device.

    Raises
    ------
    UsageError
        If options are not known or contradict each other, or the link is of another kind.
    LinkError
        If the link does not open.
    """

    device: ClassVar[str] = ""
    """Name in messages; empty: the name of the class."""
    link_kind: ClassVar[type[Link]]
    """Kind of its link; and an example of its address."""
    address: ClassVar[str] = "those of docs/links.md"
    options_kind: ClassVar[type[Options]] = Options
    """Model of the options in a rig file's entry."""

    def __init__(self, settings: DriverSettings) -> None:
        device = self.device or type(self).__name__
        self.clock = settings.clock
        """Nanoseconds of the host."""
        self.options: Any = read_options(self.options_kind, settings.options, device)
        self.link: Any = open_for(settings, device, self.link_kind, self.address)

    @property
    @abstractmethod
    def streams(self) -> tuple[StreamSpec, ...]:
        """Streams that it reads, as it is set up now; rates as far as they are known."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Counts since it was opened, by name: parity errors, frames lost, and others."""
        return {}

    def identify(self) -> Mapping[str, str]:
        """Return the identity that the device reports (model, serial, firmware); called before :meth:`start`.

        Raises
        ------
        LinkTimeout, LinkUnplugged, RigError
            If it does not answer, or is another device.
        """
        return {}

    @abstractmethod
    def start(self) -> None:
        """Set the device up and let it sample; raises as :meth:`identify`.

        Data from before are discarded (:meth:`~tactbench.links.link.Link.discard`): the first row is of the first
        whole frame after this call.
        """

    @abstractmethod
    def read(self, timeout_s: float) -> list[Block]:
        """Return the rows received since the last call, a block for each stream that has any.

        Parameters
        ----------
        timeout_s
            Longest wait for the first row [s]. Without a row the list is empty, which is no error.

        Returns
        -------
        list of Block
            ``t_ns`` on the host's clock, as well as the driver knows it at receipt. ``device_ns`` where the device has
            a clock of its own, and ``sequence`` where it numbers its samples, both unwrapped.
        """

    @abstractmethod
    def stop(self) -> None:
        """Let the device stop sampling, and drop data under way. Raises nothing if the device is gone."""

    def close(self) -> None:
        """Stop if it is sampling, and close the link; a second call does nothing."""
        self.stop()
        self.link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def fault_text(error: Exception) -> str:
    """Return the message of an error for use in a sentence: without hint and full stop."""
    return (error.message if isinstance(error, TactbenchError) else error_text(error)).rstrip(".")


_Link = TypeVar("_Link", bound=Link)


def open_for(settings: DriverSettings, device: str, kind: type[_Link], example: str) -> _Link:
    """Return the open link of a driver; raises UsageError if it is of another kind, LinkError if it does not open."""
    link = settings.open_link()
    if not isinstance(link, kind):
        link.close()
        raise UsageError(f"{device} has another kind of link than {link.address}.", hint=f"Use one like {example}.")
    return link

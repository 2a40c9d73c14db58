"""Base class of drivers: one device on one link, read in blocks of rows; and models of a device's options."""

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
    """Arguments with which a driver is made."""

    open_link: Callable[[], Link]
    """Function that opens the device's link, real or emulated."""
    streams: tuple[StreamSpec, ...] = ()
    """Streams of the sensor's spec; empty for a device other than a sensor."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of the device from the rig file; the driver refuses unknown options."""
    clock: Clock = time.monotonic_ns
    """Clock of the host [ns], also used by the link; virtual in virtual time."""


class Options(BaseModel):
    """Base model of device options or rig settings: unknown names and numbers that are not finite are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Driver(ABC):
    """Base class of drivers of one device: open from construction until :meth:`close` or the end of ``with``.

    A driver is used by one thread. It waits only in its link, so that it works in virtual time as in real time.

    Bad samples raise no error: they are marked in the blocks' quality and counted in :attr:`counts`. An error ends the
    reading: :class:`~tactbench.core.errors.LinkUnplugged` of the link, or a RigError of the device.

    Raises
    ------
    UsageError
        If options are unknown or contradict each other, or the link is of the wrong kind.
    LinkError
        If the link does not open.
    """

    device: ClassVar[str] = ""
    """Name of the device in messages; empty: the name of the class."""
    link_kind: ClassVar[type[Link]]
    """Kind of link that the driver needs, and an example of a link address."""
    address: ClassVar[str] = "an address of docs/links.md"
    options_kind: ClassVar[type[Options]] = Options
    """Model of the device's options in the rig file."""

    def __init__(self, settings: DriverSettings) -> None:
        device = self.device or type(self).__name__
        self.clock = settings.clock
        """Clock of the host [ns]."""
        self.options: Any = read_options(self.options_kind, settings.options, device)
        self.link: Any = open_for(settings, device, self.link_kind, self.address)

    @property
    @abstractmethod
    def streams(self) -> tuple[StreamSpec, ...]:
        """Streams that the driver reads in its present set-up; rates [Hz] as far as they are known."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Event counts since the driver was opened, by name: parity errors, lost frames, and others."""
        return {}

    def identify(self) -> Mapping[str, str]:
        """Return the identity that the device reports (model, serial, firmware); called before :meth:`start`.

        Raises
        ------
        LinkTimeout, LinkUnplugged, RigError
            If the device does not answer, or is another device.
        """
        return {}

    @abstractmethod
    def start(self) -> None:
        """Set the device up and let it sample; raises the errors of :meth:`identify`.

        Data from before are discarded (:meth:`~tactbench.links.link.Link.discard`): the first row is of the first
        whole frame after this call.
        """

    @abstractmethod
    def read(self, timeout_s: float) -> list[Block]:
        """Return the rows received since the last call, one block for each stream with new rows.

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
        """Let the device stop sampling, and drop data under way. Raises no error if the device is gone."""

    def close(self) -> None:
        """Stop a device that is sampling, and close the link; a second call does nothing."""
        self.stop()
        self.link.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def fault_text(error: Exception) -> str:
    """Return the message of an error for use inside a sentence: without its hint and final full stop."""
    return (error.message if isinstance(error, TactbenchError) else error_text(error)).rstrip(".")


_Link = TypeVar("_Link", bound=Link)


def open_for(settings: DriverSettings, device: str, kind: type[_Link], example: str) -> _Link:
    """Return the open link of a driver; raises UsageError for a wrong kind of link, LinkError if it does not open."""
    link = settings.open_link()
    if not isinstance(link, kind):
        link.close()
        raise UsageError(f"{device} cannot use the kind of link {link.address}.", hint=f"Use a link like {example}.")
    return link

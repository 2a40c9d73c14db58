"""A driver of one stream, for devices that need no more than a way to turn what comes into rows."""

from __future__ import annotations

from abc import abstractmethod
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from tactbench.core.errors import LinkError
from tactbench.core.samples import Block
from tactbench.core.spec.sensor import StreamSpec
from tactbench.devices.driver import Driver, DriverSettings
from tactbench.links.byte_link import ByteLink
from tactbench.links.can_link import CanLink
from tactbench.links.datagram_link import DatagramLink

L = TypeVar("L", ByteLink, CanLink, DatagramLink)


class Sample(NamedTuple):
    """One sample of each channel."""

    values: Sequence[float]
    """As many numbers as the stream has channels."""
    quality: Sequence[int] | None = None
    """A :class:`~tactbench.core.samples.Quality` each; None: all good."""
    t_ns: int | None = None
    """When it came, where its last piece came before what completes it; None: with what was received."""


class RowDriver(Driver, Generic[L]):
    """One stream behind one link; a subclass says what the link is and how what comes becomes :meth:`rows`.

    Rows have the time at which the host had them. A device with several streams, numbers or a clock of its own needs a
    :class:`Driver`.

    """

    stream: ClassVar[StreamSpec]
    """What it reads."""
    link: L

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        self.counted: Counter[str] = Counter()
        """What :attr:`counts` tells: subclasses count here what they leave out."""

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """The one stream."""
        return (self.stream,)

    @property
    def counts(self) -> Mapping[str, int]:
        """What was counted, by name, by the driver and by its link."""
        return {**getattr(self.link, "counts", {}), **self.counted}

    def start(self) -> None:
        """Drop what came before, and :meth:`begin`."""
        self.link.discard()
        self.begin()

    def begin(self) -> None:
        """Nothing, unless a subclass has a part of a frame to forget, or something to send."""

    def ask(self) -> None:
        """Nothing, unless a device is to be asked before its answer is read."""

    @abstractmethod
    def rows(self, received: Any) -> Iterable[Sample]:
        """Return the rows that are complete with what was received.

        Parameters
        ----------
        received
            Of a ByteLink or DatagramLink a ``Received`` (data, t_ns), of a CanLink a ``CanFrame``.
        """

    def read(self, timeout_s: float) -> list[Block]:
        """Return what has come."""
        self.ask()
        times: list[int] = []
        found: list[Sample] = []
        link = self.link
        until_s = link.timer() + timeout_s
        while not found:
            for received in link.receive_all(max(0.0, until_s - link.timer())):
                fresh = list(self.rows(received))
                times += [received.t_ns if row.t_ns is None else row.t_ns for row in fresh]
                found += fresh
            if not found and link.timer() >= until_s:
                return []
        data = np.array([row.values for row in found]).astype(self.stream.dtype)
        good = [0] * data.shape[1]
        quality = np.array([good if row.quality is None else row.quality for row in found], dtype=np.uint8)
        return [Block(self.stream.name, np.array(times, np.int64), data, quality if quality.any() else None)]

    def stop(self) -> None:
        """Nothing, unless :meth:`quiet` sends something; raises nothing if the device is gone."""
        with suppress(LinkError):
            self.quiet()

    def quiet(self) -> None:
        """Nothing, unless the device can be told to stop."""

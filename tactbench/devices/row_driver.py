"""Base class of simple drivers with one stream, for devices whose received data are directly converted to rows."""

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
from tactbench.links.can_link import CanLink
from tactbench.links.link import ByteLink, DatagramLink

L = TypeVar("L", ByteLink, CanLink, DatagramLink)


class Sample(NamedTuple):
    """One row: a value of each channel."""

    values: Sequence[float]
    """Values in the order of the stream's channels."""
    quality: Sequence[int] | None = None
    """One :class:`~tactbench.core.samples.Quality` for each channel; None: all good."""
    t_ns: int | None = None
    """Time of receipt [ns], if it differs from that of the data which complete the row; None: that of these data."""


class RowDriver(Driver, Generic[L]):
    """Driver of one stream on one link; a subclass states the kind of link and converts received data to :meth:`rows`.

    Rows get their time of receipt. A device with several streams, sample numbers or its own clock needs a
    :class:`Driver`.
    """

    stream: ClassVar[StreamSpec]
    """Stream that the driver reads."""
    link: L

    def __init__(self, settings: DriverSettings) -> None:
        super().__init__(settings)
        self.counted: Counter[str] = Counter()
        """Event counts of a subclass by name, such as damaged frames."""

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """Return the only stream."""
        return (self.stream,)

    @property
    def counts(self) -> Mapping[str, int]:
        """Event counts of the driver and of its link, by name."""
        return {**getattr(self.link, "counts", {}), **self.counted}

    def start(self) -> None:
        """Discard received data, and call :meth:`begin`."""
        self.link.discard()
        self.begin()

    def begin(self) -> None:
        """Drop a partial frame and let the device sample, in subclasses where this is needed."""

    def ask(self) -> None:
        """Send a request, in subclasses whose device only answers requests; called before each read."""

    @abstractmethod
    def rows(self, received: Any) -> Iterable[Sample]:
        """Return the rows completed by received data.

        Parameters
        ----------
        received
            A ``Received`` (data, t_ns) of a ByteLink or DatagramLink, or a ``CanFrame`` of a CanLink.
        """

    def read(self, timeout_s: float) -> list[Block]:
        """Return the rows received since the last call, in one block or none."""
        self.ask()
        times: list[int] = []
        found: list[Sample] = []
        link = self.link
        until_s = link.timer() + timeout_s
        while not found:
            for received in link.receive_all(max(0.0, until_s - link.timer())):
                for row in self.rows(received):
                    times.append(received.t_ns if row.t_ns is None else row.t_ns)
                    found.append(row)
            if not found and link.timer() >= until_s:
                return []
        data = np.array([row.values for row in found]).astype(self.stream.dtype)
        good = [0] * data.shape[1]
        quality = np.array([good if row.quality is None else row.quality for row in found], dtype=np.uint8)
        return [Block(self.stream.name, np.array(times, np.int64), data, quality if quality.any() else None)]

    def stop(self) -> None:
        """Stop the device by :meth:`quiet`; raises no error if the device is gone."""
        with suppress(LinkError):
            self.quiet()

    def quiet(self) -> None:
        """Stop the device, in subclasses whose device can be stopped."""

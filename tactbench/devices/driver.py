"""Base classes of drivers, which read one device on one link in blocks of rows; options, and numbering of the rows."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Generic, NamedTuple, Self, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict

from tactbench.core.errors import LinkError, TactbenchError, UsageError, error_text
from tactbench.core.samples import Block, IntArray, Quality
from tactbench.core.spec.sensor import StreamSpec
from tactbench.links.address import read_options
from tactbench.links.can_link import CanLink
from tactbench.links.link import ByteLink, Clock, DatagramLink, Link

L = TypeVar("L", ByteLink, CanLink, DatagramLink)
RESTARTED = 20
"""Number of successive rows with rising numbers below the highest number, after which a counter counts as restarted
(assumed: a network holds back fewer datagrams in order)."""


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
        self.link: Any = settings.open_link()
        if not isinstance(self.link, self.link_kind):
            self.link.close()
            hint = f"Use a link like {self.address}."
            raise UsageError(f"{device} cannot be used on a link like {self.link.address}.", hint=hint)

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


class Unwrap:
    """Conversion of a device's counter of `bits` bits to numbers without overflow.

    The difference d from the highest count so far, modulo 2^bits, classifies a count: 0 is a duplicate, 1 the next one,
    up to 2^(bits-1) - 1 one after a gap of d - 1, above that a late one (derived: half of the range each way; for 32
    bits the same as pyNetFT's sequence.cpp). A late row gets its own number, and the highest stays. The counter must
    not advance by more than half a wrap between two counts: 32 bits at 7 kHz take 85 hours for that.
    """

    def __init__(self, bits: int) -> None:
        self._modulus = 1 << bits
        self._highest: int | None = None

    def __call__(self, counts: npt.ArrayLike) -> IntArray:
        """Return (n,) int64 numbers for (n,) `counts` in the order of receipt; the first number equals its count."""
        now = np.asarray(counts).astype(np.int64) % self._modulus
        for place, count in enumerate(now.tolist()):
            highest = count if self._highest is None else self._highest
            step = (count - highest) % self._modulus
            late = step >= self._modulus // 2
            now[place] = highest + step - late * self._modulus
            self._highest = highest if late else highest + step
        return now


class SequenceCheck:
    """Filter of one stream's rows by their numbers: drops duplicated and late rows, and marks the row after a gap.

    The counter of a device that was restarted begins again: after `RESTARTED` rows that seemed late, which are lost,
    numbers continue from the highest one, with a gap of one row or more.

    A stream without numbers passes unchanged. Its gaps are not guessed from its times: an interval of more than 1.5
    periods is as often due to a late host as to a lost row.

    Attributes
    ----------
    received
        Number of rows received.
    duplicates, late
        Number of dropped rows with the highest number so far, and with a lower number.
    gaps
        Number of rows missing at their place, including rows that came late.
    """

    def __init__(self) -> None:
        self.received = self.duplicates = self.late = self.gaps = 0
        self._highest: int | None = None
        self._shift, self._behind = 0, (0, 0)

    def __call__(self, block: Block) -> Block | None:
        """Return the block without dropped rows, with rows after a gap marked in all channels; None: no row is left."""
        self.received += len(block.data)
        if block.sequence is None or not len(block.sequence):
            return block if len(block.data) else None
        numbers = self._counted_on(block.sequence)
        if self._shift:
            block = replace(block, sequence=numbers)
        before = int(numbers[0]) - 1 if self._highest is None else self._highest
        ahead = np.maximum.accumulate(np.concatenate(([before], numbers)))
        lost = numbers - ahead[:-1] - 1
        self._highest = int(ahead[-1])
        if not lost.any():
            return block
        self.duplicates += int(np.count_nonzero(lost == -1))
        self.late += int(np.count_nonzero(lost < -1))
        self.gaps += int(lost[lost > 0].sum())
        quality = np.zeros(block.data.shape, dtype=np.uint8) if block.quality is None else block.quality.copy()
        quality[lost > 0] |= np.uint8(Quality.GAP)
        kept = replace(block, quality=quality).rows(lost >= 0)
        return kept if len(kept.data) else None

    def _counted_on(self, numbers: IntArray) -> IntArray:
        """Return numbers that continue from the highest number after the device's counter has restarted."""
        numbers = numbers + self._shift
        highest = int(numbers[0]) - 1 if self._highest is None else self._highest
        if numbers[0] > highest and (np.diff(numbers) > 0).all():
            self._behind = (0, 0)
            return numbers
        added = 0
        for place, number in enumerate(numbers.tolist()):
            last, rows = self._behind
            if number + added < highest:
                self._behind = (number, rows + 1 if number == last + 1 else 1)
                if self._behind[1] == RESTARTED:
                    added = highest + 2 - number
                    # The rows before were counted as late, which are among gaps: they are lost.
                    self.gaps += 2 * (RESTARTED - 1)
            elif number + added > highest:
                self._behind = (0, 0)
            numbers[place] += added
            highest = max(highest, number + added)
        self._shift += added
        return numbers

"""The driver of a Net F/T box: records over UDP into blocks, all of them, in the order in which they come."""

from __future__ import annotations

from collections import Counter as Tally
from collections.abc import Mapping
from contextlib import suppress
from http.client import HTTPException
from urllib.parse import urlsplit
from urllib.request import ProxyHandler, build_opener

import numpy as np

from tactbench.plugin import Block, Quality, RigError, StreamSpec, UsageError
from tactbench.plugin.devices import (
    DatagramLink,
    Driver,
    DriverSettings,
    LinkError,
    LinkTimeout,
    LinkUnplugged,
    Received,
    Unwrap,
    open_for,
    read_file,
    read_options,
)
from tactbench.rigs.parallel_manipulator.force_torque.net_ft.codec import (
    CONFIGURATION_PATH,
    RECORD_BYTES,
    SENSOR_RATE_HZ,
    SEQUENCE_MODULUS,
    Command,
    NetFtOptions,
    Request,
    decode_records,
    encode_request,
    quality,
    status_text,
)
from tactbench.rigs.parallel_manipulator.force_torque.wrench import AXES, STREAM, stream

QUIET_S = 0.05
"""After which a box that was stopped sends no more (assumed: a network of one cable, a busy host)."""
ANSWER_S = 0.5
"""Within which a box answers, over the time its records take (assumed: a network of one cable)."""
RESTARTED = 1000
"""A number so far behind the highest is of a counter begun anew (assumed: no datagram is late by more)."""
LARGEST_BYTES = 1 << 20
"""Of the box's configuration (assumed: it has a few thousand)."""
HTTP_S = 3.0
"""Of each wait for the box's web page (assumed)."""
MOST_DATAGRAMS = 4096
"""In one block: 4 s at 1 kHz."""


class NetFtDriver(Driver):
    """A box on a datagram link.

    Blocks hold every record that came, in the order of arrival: `sequence` is the record's own number, so that one that
    came twice has the same and one that came late a lower one. `device_ns` is the box's count of its own samples at
    7 kHz, as time: a clock as good as the box's oscillator, and only as long as it samples. `t_ns` is the receipt.

    A saturated sensor marks all six channels SATURATED, any other error of the status word SUSPECT, and both both; a
    threshold set in the box is a warning: it is counted, its values are good. Nothing is asked for again where nothing
    comes: `read` then returns nothing.
    """

    def __init__(self, settings: DriverSettings) -> None:
        self._options = options = read_options(NetFtOptions, settings.options, "net-ft")
        self._clock = settings.clock
        self._counts: Tally[str] = Tally()
        self._kept: list[Received] = []
        self._sampling = self._silent = False
        self._numbers, self._ticks, self._newest = Unwrap(32), Unwrap(32), 0
        self._link = open_for(settings, "net-ft", DatagramLink, "udp://192.168.1.1:49152")  # type: ignore[type-abstract]
        try:
            self._scale = options.scale(self._configuration())
        except BaseException:
            self._link.close()
            raise

    def _configuration(self) -> bytes:
        given = self._options.configuration
        if given == "http":
            host = urlsplit(self._link.address).hostname
            if host is None:
                raise UsageError(
                    f"{self._link.address} names no host to ask for the box's web page.",
                    hint="Give its whole address, configuration: http://192.168.1.1/netftapi2.xml.",
                )
            given = f"http://{f'[{host}]' if ':' in host else host}{CONFIGURATION_PATH}"
        if not given:
            return b""
        return fetched(given) if given.startswith("http://") else read_file(given, "The box's configuration")

    @property
    def streams(self) -> tuple[StreamSpec, ...]:
        """`force_torque`, at the rate that the options state, as the box rounds it."""
        return (stream(SENSOR_RATE_HZ / self._options.every),)

    @property
    def counts(self) -> Mapping[str, int]:
        """``rejected`` datagrams; records with ``errors``, ``saturated`` ones among them, and with ``warnings``.

        Those that are 0 are left out.
        """
        return {name: count for name, count in self._counts.items() if count}

    def identify(self) -> Mapping[str, str]:
        """Ask for two records; return product, rate and status.

        Raises
        ------
        LinkTimeout
            If two records in a row do not come.
        RigError
            If the box sends at another rate than the options state, or is sampling.
        """
        if self._sampling:
            raise RigError("The box is sampling.", hint="Ask it before it is started, or stop it first.")
        self._silence()
        self._send(Command.START_REALTIME, 2)
        first, second = (decode_records(self._next().data)[0] for _ in range(2))
        every = (int(second["ft_sequence"]) - int(first["ft_sequence"])) % SEQUENCE_MODULUS
        if every != self._options.every:
            raise RigError(
                f"The box sends every {every}th of its {SENSOR_RATE_HZ} samples a second, expected was every "
                f"{self._options.every}th (rate_hz: {self._options.rate_hz:g}).",
                hint=f"Set the RDT rate on its web page, or write rate_hz: {SENSOR_RATE_HZ / max(every, 1):.6g}.",
            )
        return {
            "model": self._scale.product or "Net F/T",
            "rate_hz": f"{SENSOR_RATE_HZ / every:.6g}",
            "status": status_text(int(second["status"])),
        }

    def start(self) -> None:
        """Take the bias if the options ask for it, let the box send, and wait for the first datagram.

        Raises
        ------
        LinkTimeout
            If none comes.
        """
        if self._options.bias:
            self.tare()
        if not self._silent:
            self._silence()
        self._silent = False
        self._link.discard()
        self._numbers, self._ticks, self._newest = Unwrap(32), Unwrap(32), 0
        self._send(Command.START_REALTIME)
        self._sampling = True
        self._kept = [self._next()]

    def read(self, timeout_s: float) -> list[Block]:
        """Return the records that came.

        Raises
        ------
        RigError
            If the box has begun to count anew.
        LinkUnplugged
            If the network says that nobody listens there.
        """
        came, self._kept = self._kept, []
        try:
            while len(came) < MOST_DATAGRAMS:
                came.append(self._link.receive(0.0 if came else timeout_s))
        except LinkTimeout:
            pass
        except LinkUnplugged:
            if not came:
                raise
        good = [piece for piece in came if self._whole(piece.data)]
        return [self._block(good)] if good else []

    def stop(self) -> None:
        """Let the box send no more, and wait until nothing comes."""
        if self._sampling:
            self._sampling = False
            self._kept = []
            with suppress(LinkError):
                self._silence()

    def tare(self) -> bool:
        """Let the box take its present reading as zero; records already under way are still of the old zero."""
        self._send(Command.SET_SOFTWARE_BIAS)
        return True

    def close(self) -> None:
        """Stop, and close the link."""
        self.stop()
        self._link.close()

    def _send(self, command: Command, records: int = 0) -> None:
        self._link.send(encode_request(Request(command, records)))

    def _silence(self) -> None:
        """Stop the box, and drop what it sent before: records of an earlier start would seem to be of the next one."""
        self._send(Command.STOP)
        with suppress(LinkTimeout):
            for _ in range(MOST_DATAGRAMS):
                self._link.receive(QUIET_S + 2 * self._options.every / SENSOR_RATE_HZ)
        self._silent = True

    def _next(self) -> Received:
        return self._link.receive(ANSWER_S + 2 * self._options.every / SENSOR_RATE_HZ)

    def _whole(self, datagram: bytes) -> bool:
        whole = len(datagram) == RECORD_BYTES
        self._counts["rejected"] += not whole
        return whole

    def _block(self, came: list[Received]) -> Block:
        records = decode_records(b"".join(piece.data for piece in came))
        marks = None
        if records["status"].any():
            words, which = np.unique(records["status"], return_inverse=True)
            each = np.array([int(quality(int(word))) for word in words], dtype=np.uint8)[which]
            marks = np.repeat(each[:, None], len(AXES), axis=1)
            self._counts["errors"] += int((each != 0).sum())
            self._counts["saturated"] += int(((each & Quality.SATURATED) != 0).sum())
            self._counts["warnings"] += int(((records["status"] != 0) & (each == 0)).sum())
        ticks, numbers = self._ticks(records["ft_sequence"]), self._numbers(records["rdt_sequence"])
        if (numbers < np.maximum.accumulate(numbers) - RESTARTED).any() or numbers[0] < self._newest - RESTARTED:
            raise RigError(
                "The Net F/T box has begun to count its samples anew: it was without power, or another host commands "
                "it.",
                hint="Check power and network; start it again unloaded, since a bias set before may be lost.",
            )
        self._newest = max(self._newest, int(numbers.max()))
        return Block(
            stream=STREAM,
            t_ns=np.array([piece.t_ns for piece in came], dtype=np.int64),
            data=self._scale.wrench(records["counts"]),
            quality=marks,
            sequence=numbers,
            # 10^9 / 7000 in whole numbers.
            device_ns=ticks * 1_000_000 // 7,
        )


def build(settings: DriverSettings) -> NetFtDriver:
    """Open the link, and read the scale where it is to be read.

    Raises
    ------
    UsageError
        For options that are not known or contradict each other, or a link that carries no datagrams.
    LinkError
        If the link does not open.
    RigError
        If the box's web page cannot be read.
    """
    return NetFtDriver(settings)


def fetched(url: str) -> bytes:
    """Return a page of a box; it is asked directly, whatever proxies are set.

    Raises
    ------
    RigError
        If it does not come, or is larger than a mebibyte.
    """
    hint = "Open it in a browser; or save it as a file and name that as configuration."
    try:
        with build_opener(ProxyHandler({})).open(url, timeout=HTTP_S) as page:
            data: bytes = page.read(LARGEST_BYTES + 1)
    except (OSError, HTTPException, ValueError) as error:
        raise RigError(f"{url} cannot be read: {error}.", hint=hint) from error
    if len(data) > LARGEST_BYTES:
        raise RigError(f"{url} is larger than {LARGEST_BYTES} bytes.", hint=hint)
    return data

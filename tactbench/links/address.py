"""Links by name: the text that a rig file gives, and the link it stands for."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self
from urllib.parse import parse_qsl, unquote

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.links.link import Clock, Link

Reader = Callable[[str], object]
"""Turns a value's text into the value; raises ValueError with what was expected."""


def _positive(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise ValueError("a positive whole number")
    return int(text)


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and 0 < int(text) < 65536):
        raise ValueError("a port, 1 to 65535")
    return int(text)


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds <= 60:
        raise ValueError("seconds, 0 to 60")
    return seconds


def _one_of(*values: str | int) -> Reader:
    named = {str(value): value for value in values}

    def read(text: str) -> object:
        if text not in named:
            raise ValueError(f"one of {', '.join(named)}")
        return named[text]

    return read


@dataclass(frozen=True)
class _Kind:
    example: str
    keys: Mapping[str, Reader] = field(default_factory=dict)
    needed: tuple[str, ...] = ()


_LINE = {"baud": _positive, "parity": _one_of("none", "even", "odd"), "stop_bits": _one_of(1, 2)}
_SPI = {"speed_hz": _positive, "mode": _one_of(0, 1, 2, 3)}

KINDS = MappingProxyType(
    {
        "serial": _Kind("serial:///dev/ttyUSB0?baud=115200", _LINE, ("baud",)),
        "spy": _Kind("spy:///dev/ttyUSB0?baud=115200", _LINE, ("baud",)),
        "rfc2217": _Kind("rfc2217://192.168.1.5:2217?baud=115200", _LINE, ("baud",)),
        "socket": _Kind("socket://192.168.1.5:4001"),
        "loop": _Kind("loop://"),
        "can/socketcan": _Kind("can://socketcan/can0?bitrate=1000000", {"bitrate": _positive}),
        "can/slcan": _Kind(
            "can://slcan//dev/ttyACM0?bitrate=1000000",
            {"bitrate": _positive, "baud": _positive, "settle_s": _seconds},
            ("bitrate",),
        ),
        "can/udp_multicast": _Kind("can://udp_multicast/239.74.163.2?port=43113", {"port": _port}),
        "can/virtual": _Kind("can://virtual/bus"),
        "can/log": _Kind("can://log/recorded.blf"),
        "udp": _Kind("udp://192.168.1.1:49152", {"local_port": _port, "buffer_bytes": _positive}),
        "spi/spidev": _Kind("spi://spidev/0.0?speed_hz=4400000", _SPI, ("speed_hz",)),
        "spi/bridge": _Kind("spi://bridge//dev/ttyACM0?speed_hz=4400000", {**_SPI, "baud": _positive}, ("speed_hz",)),
    }
)
"""Kind of link -> how its address looks and which keys it has."""


@dataclass(frozen=True)
class LinkAddress:
    """What names a link: ``scheme://target?key=value&key=value``, every part of it understood.

    Examples
    --------
    >>> LinkAddress.parse("udp://192.168.1.1:49152").target
    '192.168.1.1:49152'
    """

    text: str
    kind: str
    """A key of :data:`KINDS`."""
    target: str
    """Port, channel, host or file."""
    options: Mapping[str, Any]
    """Keys and values, as the link takes them."""

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the parts of an address; nothing is opened.

        Raises
        ------
        UnknownNameError
            If the scheme, the kind of bus or a key is unknown; the message has the nearest ones.
        UsageError
            If a part is missing, given twice or not what is expected; the message has an example.
        """
        scheme, separator, rest = text.partition("://")
        if not separator:
            raise UsageError(
                f"{text!r} is not the address of a link.", hint=f"Write it like {KINDS['serial'].example}."
            )
        target, _, query = rest.partition("?")
        target = unquote(target)
        kind = scheme
        schemes = {name.partition("/")[0] for name in KINDS}
        if scheme not in schemes:
            raise UnknownNameError("link", scheme, schemes)
        if scheme not in KINDS:
            inner, _, target = target.partition("/")
            kind = f"{scheme}/{inner}"
            if kind not in KINDS:
                known = [name.partition("/")[2] for name in KINDS if name.startswith(f"{scheme}/")]
                raise UnknownNameError(f"kind of {scheme}:// link", inner, known)
        what = KINDS[kind]
        if not target and kind != "loop":
            raise _wrong(text, kind, "does not say what to open")
        try:
            pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
        except ValueError:
            raise _wrong(text, kind, f"has {query!r} where key=value was expected") from None
        options: dict[str, object] = {}
        for key, value in pairs:
            if key not in what.keys:
                if not what.keys:
                    raise _wrong(text, kind, f"has the key {key!r}, but {kind} takes none")
                raise UnknownNameError(f"key of a {kind} link", key, what.keys)
            if key in options:
                raise _wrong(text, kind, f"gives {key} twice")
            try:
                options[key] = what.keys[key](value)
            except ValueError as expected:
                raise _wrong(text, kind, f"gives {key}={value}, expected is {expected}") from None
        for key in what.needed:
            if key not in options:
                raise _wrong(text, kind, f"does not give {key}")
        if kind in ("udp", "socket"):
            _host_and_port(text, kind, target)
        return cls(text, kind, target, MappingProxyType(options))

    def open(self, clock: Clock = time.monotonic_ns) -> Link:
        """Open the link.

        Raises
        ------
        LinkError
            If that is not possible.
        """
        match self.kind.split("/"):
            case ["udp"]:
                from tactbench.links.datagram_link import UdpLink

                host, port = _host_and_port(self.text, self.kind, self.target)
                return UdpLink(host, port, clock=clock, **self.options)
            case ["can", "log"]:
                from tactbench.links.can_log import CanLog

                return CanLog(Path(self.target))
            case ["can", interface]:
                from tactbench.links.can_link import CanBus

                return CanBus(interface, self.target, clock=clock, **self.options)  # type: ignore[arg-type]
            case ["spi", "bridge"]:
                from tactbench.links.byte_link import SerialLink
                from tactbench.links.spi_bridge import SpiBridge

                line = {key: value for key, value in self.options.items() if key not in _SPI}
                bus = {key: value for key, value in self.options.items() if key in _SPI}
                return SpiBridge(SerialLink(self.target, clock=clock, **line), **bus)
            case ["spi", _]:
                from tactbench.links.spidev import SpidevLink

                return SpidevLink(self.target, clock=clock, **self.options)
        from tactbench.links.byte_link import SerialLink

        url = self.target if self.kind == "serial" else f"{self.kind}://{self.target}"
        return SerialLink(url, clock=clock, **self.options)


def open_link(address: str, clock: Clock = time.monotonic_ns) -> Link:
    """Open the link that an address names; use it in a ``with`` block.

    Parameters
    ----------
    address
        As in ``docs/links.md``.
    clock
        Stamps what is received.

    Raises
    ------
    UnknownNameError, UsageError
        If the address is not one.
    LinkError
        If the link cannot be opened.
    """
    return LinkAddress.parse(address).open(clock)


def _host_and_port(text: str, kind: str, target: str) -> tuple[str, int]:
    host, _, port = target.rpartition(":")
    try:
        number = _port(port)
    except ValueError:
        raise _wrong(text, kind, "does not end in a port, 1 to 65535") from None
    host = host.removeprefix("[").removesuffix("]")
    if not host:
        raise _wrong(text, kind, "names no host")
    return host, number


def _wrong(text: str, kind: str, problem: str) -> UsageError:
    return UsageError(f"The address {text!r} {problem}.", hint=f"Write it like {KINDS[kind].example}.")

"""Links by name: the text that a rig file gives, and the link it stands for."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Self
from urllib.parse import parse_qsl, unquote

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.links.link import Clock, Link

Reader = Callable[[str], object]
"""Turns a value's text into the value; raises ValueError with what was expected."""


def _whole(text: str, most: float = float("inf"), what: str = "a positive whole number") -> int:
    if not (text.isascii() and text.isdigit() and 0 < int(text) <= most):
        raise ValueError(what)
    return int(text)


def _port(text: str) -> int:
    return _whole(text, 65535, "a port, 1 to 65535")


def _one_of(*values: str | int) -> Reader:
    named = {str(value): value for value in values}

    def read(text: str) -> object:
        if text not in named:
            raise ValueError(f"one of {', '.join(named)}")
        return named[text]

    return read


def _plain(text: str) -> int | float | str:
    """Return an option of python-can: a number if it is one."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


class _Kind(NamedTuple):
    example: str
    keys: Mapping[str, Reader] = {}
    """Which there are, and how their values are read."""
    needed: tuple[str, ...] = ()


_LINE = {"baud": _whole, "parity": _one_of("none", "even", "odd"), "stop_bits": _one_of(1, 2)}
_SPI = {"speed_hz": _whole, "mode": _one_of(0, 1, 2, 3)}

KINDS = MappingProxyType(
    {
        "serial": _Kind("serial:///dev/ttyUSB0?baud=115200", _LINE, ("baud",)),
        "spy": _Kind("spy:///dev/ttyUSB0?baud=115200", _LINE, ("baud",)),
        "rfc2217": _Kind("rfc2217://192.168.1.5:2217?baud=115200", _LINE, ("baud",)),
        "socket": _Kind("socket://192.168.1.5:4001"),
        "loop": _Kind("loop://"),
        "can": _Kind("can://socketcan/can0"),
        "udp": _Kind("udp://192.168.1.1:49152", {"local_port": _port, "buffer_bytes": _whole}),
        "spi/spidev": _Kind("spi://spidev/0.0?speed_hz=4400000", _SPI, ("speed_hz",)),
        "spi/bridge": _Kind("spi://bridge//dev/ttyACM0?speed_hz=4400000", {**_SPI, "baud": _whole}, ("speed_hz",)),
    }
)
"""Kind of link -> how its address looks and which keys it has; those of ``can`` are python-can's."""


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
    """Port, channel, host or file; of ``can`` the interface, a slash and the channel."""
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
        kind, separator, rest = text.partition("://")
        if not separator:
            raise UsageError(
                f"{text!r} is not the address of a link.", hint=f"Write it like {KINDS['serial'].example}."
            )
        target, _, query = rest.partition("?")
        target = unquote(target)
        schemes = {name.partition("/")[0] for name in KINDS}
        if kind not in schemes:
            raise UnknownNameError("link", kind, schemes)
        if kind == "spi":
            inner, _, target = target.partition("/")
            kind = f"{kind}/{inner}"
            if kind not in KINDS:
                raise UnknownNameError("kind of spi:// link", inner, ("spidev", "bridge"))
        if kind == "can":
            _check_interface(target.partition("/")[0])
        if kind != "loop" and not (target.partition("/")[2] if kind == "can" else target):
            raise _wrong(text, kind, "does not say what to open")
        address = cls(text, kind, target, MappingProxyType(_options(text, kind, query)))
        if kind in ("udp", "socket"):
            address._host_and_port()
        return address

    def open(self, clock: Clock = time.monotonic_ns) -> Link:
        """Open the link.

        Raises
        ------
        LinkError
            If that is not possible.
        UnknownNameError
            If an interface of python-can does not know one of the options.
        """
        from tactbench.links.byte_link import SerialLink

        match self.kind:
            case "udp":
                from tactbench.links.datagram_link import UdpLink

                return UdpLink(*self._host_and_port(), clock=clock, **self.options)
            case "can":
                from tactbench.links.can_link import CanBus, CanLog

                interface, _, channel = self.target.partition("/")
                if interface == "log":
                    return CanLog(Path(channel))
                return CanBus(interface, channel, clock=clock, **self.options)
            case "spi/bridge":
                from tactbench.links.spi_bridge import SpiBridge

                line = {key: value for key, value in self.options.items() if key not in _SPI}
                bus = {key: value for key, value in self.options.items() if key in _SPI}
                return SpiBridge(SerialLink(self.target, clock=clock, **line), **bus)
            case "spi/spidev":
                from tactbench.links.spi_link import SpidevLink

                return SpidevLink(self.target, clock=clock, **self.options)
        url = self.target if self.kind == "serial" else f"{self.kind}://{self.target}"
        return SerialLink(url, clock=clock, **self.options)

    def _host_and_port(self) -> tuple[str, int]:
        host, _, port = self.target.rpartition(":")
        try:
            number = _port(port)
        except ValueError:
            raise _wrong(self.text, self.kind, "does not end in a port, 1 to 65535") from None
        host = host.removeprefix("[").removesuffix("]")
        if not host:
            raise _wrong(self.text, self.kind, "names no host")
        return host, number


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


def _check_interface(name: str) -> None:
    import can

    if name not in can.VALID_INTERFACES and name != "log":
        raise UnknownNameError("kind of can:// link", name, (*sorted(can.VALID_INTERFACES), "log"))


def _options(text: str, kind: str, query: str) -> dict[str, object]:
    what = KINDS[kind]
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError:
        raise _wrong(text, kind, f"has {query!r} where key=value was expected") from None
    options: dict[str, object] = {}
    for key, value in pairs:
        if kind != "can" and key not in what.keys:
            raise UnknownNameError(f"key of a {kind} link", key, what.keys)
        if key in options:
            raise _wrong(text, kind, f"gives {key} twice")
        try:
            options[key] = what.keys.get(key, _plain)(value)
        except ValueError as expected:
            raise _wrong(text, kind, f"gives {key}={value}, expected is {expected}") from None
    for key in what.needed:
        if key not in options:
            raise _wrong(text, kind, f"does not give {key}")
    return options


def _wrong(text: str, kind: str, problem: str) -> UsageError:
    return UsageError(f"The address {text!r} {problem}.", hint=f"Write it like {KINDS[kind].example}.")

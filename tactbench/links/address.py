"""Links by name: the text that a rig file gives, and the link it stands for."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Self
from urllib.parse import parse_qsl, unquote

from pydantic import BaseModel, ConfigDict, Field, PositiveInt, ValidationError

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.links.link import Clock, Link


class _None(BaseModel):
    pass


class _Line(BaseModel):
    baud: PositiveInt
    parity: Literal["none", "even", "odd"] = "none"
    stop_bits: Literal[1, 2] = 1


class _Udp(BaseModel):
    local_port: int = Field(default=0, gt=0, lt=65536)
    buffer_bytes: PositiveInt = 1


class _Spi(BaseModel):
    speed_hz: PositiveInt
    mode: Literal[0, 1, 2, 3] = 0


class _Bridge(_Spi):
    baud: PositiveInt = 1


class _Can(BaseModel):
    model_config = ConfigDict(extra="allow")


class _Kind(NamedTuple):
    example: str
    options: type[BaseModel] = _None


KINDS = MappingProxyType(
    {
        "serial": _Kind("serial:///dev/ttyUSB0?baud=115200", _Line),
        "spy": _Kind("spy:///dev/ttyUSB0?baud=115200", _Line),
        "rfc2217": _Kind("rfc2217://192.168.1.5:2217?baud=115200", _Line),
        "socket": _Kind("socket://192.168.1.5:4001"),
        "loop": _Kind("loop://"),
        "can": _Kind("can://socketcan/can0", _Can),
        "udp": _Kind("udp://192.168.1.1:49152", _Udp),
        "spi/spidev": _Kind("spi://spidev/0.0?speed_hz=4400000", _Spi),
        "spi/bridge": _Kind("spi://bridge//dev/ttyACM0?speed_hz=4400000", _Bridge),
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
                from tactbench.links.can_link import CanBus

                interface, _, channel = self.target.partition("/")
                return CanBus(interface, channel, clock=clock, **self.options)
            case "spi/bridge":
                from tactbench.links.spi_bridge import SpiBridge

                line = {key: value for key, value in self.options.items() if key == "baud"}
                bus = {key: value for key, value in self.options.items() if key != "baud"}
                return SpiBridge(SerialLink(self.target, clock=clock, **line), **bus)
            case "spi/spidev":
                from tactbench.links.spi_link import SpidevLink

                return SpidevLink(self.target, clock=clock, **self.options)
        url = self.target if self.kind == "serial" else f"{self.kind}://{self.target}"
        return SerialLink(url, clock=clock, **self.options)

    def _host_and_port(self) -> tuple[str, int]:
        host, _, port = self.target.rpartition(":")
        if not (port.isascii() and port.isdecimal() and 0 < int(port[:6]) < 65536):
            raise _wrong(self.text, self.kind, "does not end in a port, 1 to 65535")
        host = host.removeprefix("[").removesuffix("]")
        if not host:
            raise _wrong(self.text, self.kind, "names no host")
        return host, int(port)


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

    if name not in can.VALID_INTERFACES:
        raise UnknownNameError("kind of can:// link", name, sorted(can.VALID_INTERFACES))


def _options(text: str, kind: str, query: str) -> dict[str, object]:
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError:
        raise _wrong(text, kind, f"has {query!r} where key=value was expected") from None
    given = dict(pairs)
    if len(given) < len(pairs):
        raise _wrong(text, kind, "gives a key twice")
    model = KINDS[kind].options
    for key in given.keys() - model.model_fields.keys():
        if kind != "can":
            raise UnknownNameError(f"key of a {kind} link", key, model.model_fields)
    try:
        found = model.model_validate({key: _plain(value) for key, value in pairs})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = str(first["loc"][0])
        problem = f"does not give {key}" if first["type"] == "missing" else f"gives {key}={given[key]}: {first['msg']}"
        raise _wrong(text, kind, problem) from None
    return found.model_dump(exclude_unset=True)


def _plain(text: str) -> int | float | str:
    """Return a value as a number if it is one."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _wrong(text: str, kind: str, problem: str) -> UsageError:
    return UsageError(f"The address {text!r} {problem}.", hint=f"Write it like {KINDS[kind].example}.")

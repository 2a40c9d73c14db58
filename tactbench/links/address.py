"""Addresses of links, as written in a rig file: parsing them, and opening the links that they name."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, TypeVar
from urllib.parse import parse_qsl, unquote, urlsplit

from pydantic import BaseModel, Field, PositiveInt, ValidationError

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.links.link import Clock, Link


class _None(BaseModel):
    pass


class _Line(BaseModel):
    baud: PositiveInt
    parity: Literal["none", "even", "odd"] = "none"
    stop_bits: int = Field(default=1, ge=1, le=2)


class _Bridge(BaseModel):
    speed_hz: PositiveInt
    mode: int = Field(default=0, ge=0, le=3)
    baud: PositiveInt = 115200


class _Kind(NamedTuple):
    example: str
    options: type[BaseModel] = _None


KINDS = {
    "serial": _Kind("serial:///dev/ttyUSB0?baud=115200", _Line),
    "spy": _Kind("spy:///dev/ttyUSB0?baud=115200", _Line),
    "socket": _Kind("socket://192.168.1.5:4001"),
    "loop": _Kind("loop://"),
    "can": _Kind("can://socketcan/can0"),
    "udp": _Kind("udp://192.168.1.1:49152"),
    "spi/bridge": _Kind("spi://bridge//dev/ttyACM0?speed_hz=4400000", _Bridge),
}
"""Kind of link -> example and keys of its address; the keys of ``can`` are python-can's."""


_Model = TypeVar("_Model", bound=BaseModel)


def read_options(kind: type[_Model], given: Mapping[str, Any], what: str, *, hint: str = "") -> _Model:
    """Return the given options as a validated model; `what` names their owner in messages: a device, an address.

    Raises
    ------
    UsageError
        If an option is unknown, is missing, has an invalid value, or contradicts another option.
    """
    for name in given:
        if name not in kind.model_fields:
            raise UnknownNameError(f"option of {what}", name, kind.model_fields)
    try:
        return kind.model_validate(dict(given))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(map(str, first["loc"]))
        about = f"The option {name!r} of {what}" if name else f"The entry of {what}"
        problem = "is missing" if first["type"] == "missing" else f"is wrong: {first['msg']}"
        raise UsageError(
            f"{about} {problem.replace('Value error, ', '')}.", hint=hint or "See docs/hardware.md, The rig file."
        ) from error


def parse_address(text: str) -> tuple[str, str, dict[str, Any]]:
    """Return the parts of an address ``scheme://target?key=value&key=value``, without opening the link.

    Returns
    -------
    kind
        A key of :data:`KINDS`.
    target
        Port, channel, host or file; for ``can`` the interface, a slash and the channel.
    options
        Options of the link by name, converted to their types.

    Raises
    ------
    UnknownNameError
        If the scheme, the kind of bus or a key is unknown; the message names similar known ones.
    UsageError
        If a value is missing or invalid; the hint has an example.
    """
    kind, separator, rest = text.partition("://")
    if not separator:
        raise _wrong(text, "serial", "has no ://")
    target, _, query = rest.partition("?")
    target = unquote(target)
    if kind == "spi":
        bus, _, target = target.partition("/")
        kind = f"spi/{bus}"
    if kind not in KINDS:
        raise UnknownNameError("kind of link", kind, KINDS)
    given = dict(parse_qsl(query, keep_blank_values=True))
    if kind == "can":
        from can.util import cast_from_string

        return kind, target, {key: cast_from_string(value) for key, value in given.items()}
    example, model = KINDS[kind]
    options = read_options(model, given, f"the address {text!r}", hint=f"Write it like {example}.")
    return kind, target, options.model_dump()


def open_link(address: str, clock: Clock = time.monotonic_ns) -> Link:
    """Open the link that an address names; use it in a ``with`` block.

    Parameters
    ----------
    address
        Address of the link; ``docs/links.md`` describes the forms.
    clock
        Function that returns the times of receipt [ns].

    Raises
    ------
    UnknownNameError, UsageError
        If the address is not valid, or an interface of python-can has no such option.
    LinkError
        If the link cannot be opened.
    """
    from tactbench.links.can_link import CanBus
    from tactbench.links.link import SerialLink, UdpLink
    from tactbench.links.spi_link import SpiBridge

    kind, target, options = parse_address(address)
    match kind:
        case "udp":
            try:
                parts = urlsplit(f"//{target}")
                host, port = parts.hostname, parts.port
            except ValueError:
                host = port = None
            if not host or not port:
                raise _wrong(address, kind, "does not end in a host and a port, 1 to 65535")
            return UdpLink(host, port, clock=clock)
        case "can":
            interface, _, channel = target.partition("/")
            return CanBus(interface, channel, clock=clock, **options)
        case "spi/bridge":
            return SpiBridge(SerialLink(target, baud=options.pop("baud"), clock=clock), **options)
    return SerialLink(target if kind == "serial" else f"{kind}://{target}", clock=clock, **options)


def _wrong(text: str, kind: str, problem: str) -> UsageError:
    return UsageError(f"The address {text!r} {problem}.", hint=f"Write it like {KINDS[kind].example}.")

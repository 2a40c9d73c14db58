"""What a rig file says of a device, or of a rig, checked against a pydantic model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.devices.driver import DriverSettings
from tactbench.links.link import Link


class Options(BaseModel):
    """Options of one device, the same for its driver and its emulator."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


_Model = TypeVar("_Model", bound=BaseModel)
_Link = TypeVar("_Link", bound=Link)


def read_options(kind: type[_Model], given: Mapping[str, Any], device: str) -> _Model:
    """Return what is given as a model.

    Raises
    ------
    UsageError
        For an option that is not known, is missing, has no such value, or contradicts another.
    """
    for name in given:
        if name not in kind.model_fields:
            raise UnknownNameError(f"option of {device}", name, kind.model_fields)
    try:
        return kind.model_validate(dict(given))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(map(str, first["loc"]))
        what = f"The option {name!r} of {device}" if name else f"What is said of {device}"
        problem = "is missing" if first["type"] == "missing" else f"is wrong: {first['msg']}"
        raise UsageError(
            f"{what} {problem.replace('Value error, ', '')}.", hint="See docs/hardware.md, The rig file."
        ) from error


def read_file(path: str, what: str) -> bytes:
    """Return the bytes of a file that an option names; raises UsageError if it cannot be read."""
    try:
        return Path(path).expanduser().read_bytes()
    except OSError as error:
        raise UsageError(f"{what} cannot be read: {error}.", hint="Check the path in the rig file.") from error


def open_for(settings: DriverSettings, device: str, kind: type[_Link], example: str) -> _Link:
    """Return the open link of a driver; raises UsageError if it is of another kind, LinkError if it does not open."""
    link = settings.open_link()
    if not isinstance(link, kind):
        link.close()
        raise UsageError(f"{device} cannot be spoken to through {link.address}.", hint=f"Use a link like {example}.")
    return link

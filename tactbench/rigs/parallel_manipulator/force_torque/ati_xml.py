"""ATI's XML: elements read safely with the standard library, and the names of its units."""

from __future__ import annotations

from typing import NamedTuple, NoReturn
from xml.parsers import expat

from tactbench.plugin import UsageError

LARGEST_BYTES = 1 << 20
"""A file beyond this is refused unread (assumed: real ones have a few thousand bytes)."""

_POUND_N = 4.4482216152605
"""One pound-force: 0.45359237 kg by 9.80665 m/s^2 (sourced: international yard and pound agreement 1959, CGPM 1901)."""
_INCH_M = 0.0254
_KGF_N = 9.80665

FORCE_UNITS = {
    "N": 1.0,
    "kN": 1e3,
    "lb": _POUND_N,
    "lbf": _POUND_N,
    "klb": 1e3 * _POUND_N,
    "klbf": 1e3 * _POUND_N,
    "kg": _KGF_N,
    "kgf": _KGF_N,
    "g": 1e-3 * _KGF_N,
    "gf": 1e-3 * _KGF_N,
}
"""Name -> newtons (names sourced: ATI manual 9620-05-NET FT, table 7.3, as quoted in public clients; those without the
final f assumed)."""
TORQUE_UNITS = {
    "Nm": 1.0,
    "Nmm": 1e-3,
    "kNm": 1e3,
    "lbin": _POUND_N * _INCH_M,
    "lbfin": _POUND_N * _INCH_M,
    "lbft": _POUND_N * 12 * _INCH_M,
    "lbfft": _POUND_N * 12 * _INCH_M,
    "kgcm": _KGF_N * 1e-2,
    "kgfcm": _KGF_N * 1e-2,
}
"""Name without hyphens -> newton metres (sourced and assumed as above)."""
DISTANCE_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": _INCH_M, "ft": 12 * _INCH_M}
"""Name -> metres (sourced as above)."""


class AtiFileError(UsageError):
    """A file is not the ATI file that was expected, or is not safe to read."""


class Element(NamedTuple):
    """One element, its text without that of elements within."""

    name: str
    attributes: dict[str, str]
    text: str


def elements(data: bytes) -> list[Element]:
    """Return the elements of an XML file in the order of their start tags.

    Document types are refused, and with them entities: an entity can multiply a file a million times, or bring another
    file in.

    Raises
    ------
    AtiFileError
        If `data` is no XML, is larger than a mebibyte or has a document type.
    """
    if len(data) > LARGEST_BYTES:
        raise AtiFileError(f"An XML file of {len(data)} bytes was given; at most {LARGEST_BYTES} are read.")
    found: list[tuple[str, dict[str, str], list[str]]] = []
    open_ones: list[int] = []

    def start(name: str, attributes: dict[str, str]) -> None:
        open_ones.append(len(found))
        found.append((name, attributes, []))

    def end(_name: str) -> None:
        open_ones.pop()

    def text(piece: str) -> None:
        found[open_ones[-1]][2].append(piece)

    def refuse(*_: object) -> NoReturn:
        raise AtiFileError("The XML file declares a document type or an entity.", hint="ATI's files have none.")

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:  # the last two: encodings that Python does not have
        raise AtiFileError(f"This is not an XML file: {error}.") from error
    return [Element(name, attributes, "".join(pieces)) for name, attributes, pieces in found]


def unit(table: dict[str, float], name: str, what: str) -> float:
    """Return the SI value of a unit as ATI spells it; raises AtiFileError for one that is not in `table`."""
    plain = name.strip()
    for spelling in (plain, plain.replace("-", "").replace(".", "")):
        if spelling in table:
            return table[spelling]
    raise AtiFileError(f"The {what} unit {name!r} is not known; known: {', '.join(table)}.")

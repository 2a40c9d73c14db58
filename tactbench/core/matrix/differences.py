"""What differs between what went into two keys, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from tactbench.core.matrix.key_book import Sections

_SOURCE = "source of "
_LONGEST = 60
"""Characters of a value that are shown."""


def differences(before: Sections, now: Sections) -> list[str]:
    """Return one sentence for everything that differs, the most telling first; none if nothing does."""
    found: list[str] = []
    for name in sorted({*before, *now}, key=_order):
        old, new = before.get(name, {}), now.get(name, {})
        if old != new:
            found += _section(name, old, new)
    return found


def _order(section: str) -> tuple[int, str]:
    first = ("configuration", "data")
    last = ("versions",)
    return (first.index(section) if section in first else 9 if section in last else 5, section)


def _section(name: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    if name.startswith(_SOURCE):
        package = name.removeprefix(_SOURCE)
        if not old or not new:
            yield f"the source of {package} {'counts now' if new else 'counts no longer'}"
            return
        for file in sorted({*old, *new}):
            if old.get(file) != new.get(file):
                yield f"{package}/{file} {_came_or_went(old, new, file, 'changed')}"
    elif name == "data":
        for recording in sorted({*old, *new}):
            if _digest(old.get(recording)) != _digest(new.get(recording)):
                yield f"recording {recording} {_came_or_went(old, new, recording, 'has other bytes')}"
    else:
        within = "" if name in ("configuration", "versions") else f"{name}: "
        flat_old, flat_new = dict(_flat(old)), dict(_flat(new))
        for place in sorted({*flat_old, *flat_new}):
            if flat_old.get(place, _NONE) != flat_new.get(place, _NONE):
                yield f"{within}{place} {_shown(flat_old.get(place, _NONE))} -> {_shown(flat_new.get(place, _NONE))}"


_NONE = object()


def _digest(recording: Any) -> Any:
    """Return what decides of a recording; where it lies does not."""
    return recording.get("digest") if isinstance(recording, Mapping) else None


def _came_or_went(old: Mapping[str, Any], new: Mapping[str, Any], name: str, otherwise: str) -> str:
    return "is new" if name not in old else "is gone" if name not in new else otherwise


def _flat(facts: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every leaf with its dotted place."""
    if isinstance(facts, Mapping) and facts:
        for name, value in facts.items():
            yield from _flat(value, f"{prefix}.{name}" if prefix else str(name))
    elif isinstance(facts, list | tuple) and any(isinstance(value, Mapping | list | tuple) for value in facts):
        for place, value in enumerate(facts):
            yield from _flat(value, f"{prefix}[{place}]")
    else:
        yield prefix, list(facts) if isinstance(facts, tuple) else facts


def _shown(value: Any) -> str:
    if value is _NONE:
        return "nothing"
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"

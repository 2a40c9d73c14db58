"""YAML files checked against a model: every complaint names the file and the line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from tactbench.core.errors import ConfigError, nearest

M = TypeVar("M", bound=BaseModel)
Path_ = tuple[str | int, ...]

MOST_BYTES = 2**17
"""The parser reads some 300 kB a second; the largest file of this project has 12 kB."""
MOST_DEPTH = 32
MOST_ALIASES = 100
MOST_VALUES = 20_000
"""With every alias written out: nine lines of nine aliases each are a third of a billion values."""
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
_ODD_NUMBER = re.compile(r"[-+]?(0[0-9_]|[0-9][0-9_.]*[_:])")
"""Notations of YAML 1.1 that hardly anybody means: 010 is 8, 2025_04 is 202504, 1:30 is 90."""


def load_yaml(path: Path, model: type[M]) -> M:
    """Read `path` and return it as a `model`.

    Raises
    ------
    ConfigError
        If the file cannot be read, is not YAML, repeats a key, has an unknown or mistyped key (the nearest known one
        is offered), or a value that `model` refuses. The message starts with ``file:line``.
    """
    try:
        with path.open("rb") as opened:
            held = opened.read(MOST_BYTES + 1)
        if len(held) > MOST_BYTES:
            raise ConfigError(
                str(path), None, f"is larger than {MOST_BYTES // 1024} KiB.", hint="Is it the right file?"
            )
        text = held.decode()
    except OSError as error:
        raise ConfigError(
            str(path), None, f"cannot be read: {error.strerror}.", hint="Check the path and its permissions."
        ) from error
    except UnicodeDecodeError as error:
        raise ConfigError(str(path), None, "is not UTF-8 text.", hint="Save it as UTF-8.") from error
    try:
        node = _composed(text, str(path))
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        problem = getattr(error, "problem", None) or "is not YAML"
        raise ConfigError(
            str(path), mark.line + 1 if mark else None, f"{problem}.", hint="Check the syntax."
        ) from error
    if node is None:
        raise ConfigError(str(path), None, "is empty.", hint="See docs/ for an example.")
    lines: dict[Path_, int] = {}
    data = _construct(node, (), lines, str(path))
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _explain(error, str(path), lines, node, model) from error


def plain_value(text: str) -> Any:
    """Return what YAML reads `text` as if that is a number, a truth value or a text, else `text` itself."""
    try:
        node = _composed(text, "")
        value = _scalar(node, "") if isinstance(node, yaml.ScalarNode) else text
    except (yaml.YAMLError, ConfigError):
        return text
    return value if isinstance(value, str | int | float | bool) else text


class _LimitedLoader(yaml.SafeLoader):
    """Refuses what nests too deep, or repeats itself too often, as soon as it is read; raises ConfigError."""

    def __init__(self, text: str, file: str) -> None:
        super().__init__(text)
        self._file = file
        self._depth = self._aliases = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        inside = isinstance(event, yaml.CollectionStartEvent)
        self._depth += inside
        self._aliases += isinstance(event, yaml.AliasEvent)
        if self._depth > MOST_DEPTH or self._aliases > MOST_ALIASES:
            line = event.start_mark.line + 1 if event.start_mark else None
            deep = self._depth > MOST_DEPTH
            what = f"it nests {self._depth} deep" if deep else f"it has more than {MOST_ALIASES} aliases"
            raise ConfigError(self._file, line, f"{what}.", hint="Write it out plainly.")
        node = super().compose_node(parent, index)
        self._depth -= inside
        return node


def _composed(text: str, file: str) -> yaml.Node | None:
    """Return the nodes of a text, nothing built of them yet; raises ConfigError, yaml.YAMLError."""
    loader = _LimitedLoader(text, file)
    try:
        return loader.get_single_node()
    finally:
        loader.dispose()


def _construct(node: yaml.Node, at: Path_, lines: dict[Path_, int], file: str) -> Any:
    """Build plain data from `node`, remembering the line of every key and item."""
    lines.setdefault(at, node.start_mark.line + 1)
    if len(at) > MOST_DEPTH or len(lines) > MOST_VALUES:
        what = "an alias contains itself" if len(at) > MOST_DEPTH else f"there are more than {MOST_VALUES} values here"
        raise ConfigError(file, node.start_mark.line + 1, f"{what}.", hint="Write it out, without aliases (*).")
    if not node.tag.startswith("tag:yaml.org,2002:") or "python" in node.tag:
        raise ConfigError(
            file, node.start_mark.line + 1, f"the tag {node.tag!r} is refused.", hint="Only plain YAML is read."
        )
    if isinstance(node, yaml.MappingNode):
        built: dict[str | int, Any] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            key = _key(key_node, file)
            if key in built:
                raise ConfigError(file, line, f"the key {key!r} stands here twice.", hint="Remove one of them.")
            lines[(*at, key)] = line
            built[key] = _construct(value_node, (*at, key), lines, file)
        return built
    if isinstance(node, yaml.SequenceNode):
        return [_construct(item, (*at, place), lines, file) for place, item in enumerate(node.value)]
    return _scalar(node, file) if isinstance(node, yaml.ScalarNode) else None


def _key(node: yaml.Node, file: str) -> str | int:
    """Return a key that YAML reads as it is written: ``yes`` would become True, ``0x1f`` 31."""
    line = node.start_mark.line + 1
    if not isinstance(node, yaml.ScalarNode):
        raise ConfigError(file, line, "a key must be a word or a whole number.", hint="Quote it.")
    key, written = _scalar(node, file), node.value[:80]
    if isinstance(key, str | int) and str(key) == node.value:
        return key
    raise ConfigError(
        file, line, f"the key {written} is neither a word nor a whole number: it would be read as {key!r}.",
        hint=f"Quote it: '{written}'.",
    )  # fmt: skip


def _scalar(node: yaml.ScalarNode, file: str) -> Any:
    line, written = node.start_mark.line + 1, str(node.value)[:80]
    if node.tag in _NUMBERS and _ODD_NUMBER.match(node.value):
        raise ConfigError(
            file, line, f"{written} would be read as another number than is written.",
            hint=f"Quote it if it is a word: '{written}'; else leave out leading zeros, _ and :.",
        )  # fmt: skip
    try:
        return yaml.constructor.SafeConstructor().construct_object(node)
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigError(
            file, line, f"{written!r} cannot be read as a plain value.",
            hint="Only plain YAML is read: no tags that build objects.",
        ) from error  # fmt: skip


def _explain(
    error: ValidationError, file: str, lines: dict[Path_, int], root: yaml.Node, model: type[BaseModel]
) -> ConfigError:
    """Turn the first complaint of pydantic into one sentence with a line."""
    complaints = error.errors(include_url=False)
    # A misspelt key is both unknown and missing: the unknown one is what the writer sees on the page.
    first = next((one for one in complaints if one["type"] == "extra_forbidden"), complaints[0])
    loc = tuple(first["loc"])
    at, line = _deepest(loc, lines)
    name = ".".join(str(part) for part in at) or "the file"
    if first["type"] == "extra_forbidden":
        known = _siblings(error, loc, model)
        close = nearest(str(loc[-1]), known)
        meant = f"Did you mean {' or '.join(repr(word) for word in close)}? " if close else ""
        listing = f"Known here: {', '.join(sorted(known))}." if known else ""
        return ConfigError(file, line, f"the key {str(loc[-1])!r} is not known.", hint=f"{meant}{listing}".strip())
    if first["type"] == "missing":
        return ConfigError(file, line, f"the key {str(loc[-1])!r} is missing in {name}.", hint="Add it.")
    text = _written(root, at)
    shown = f" (given: {text if len(text) <= 80 else text[:79] + '…'})" if text else ""
    message = first["msg"].removeprefix("Value error, ")
    return ConfigError(file, line, f"{name}: {message}{shown}.", hint="Correct the value.")


def _deepest(loc: Path_, lines: dict[Path_, int]) -> tuple[Path_, int | None]:
    """Return the longest path in the file that `loc` walks; pydantic adds names of union members in between."""
    at: Path_ = ()
    for part in loc:
        if (*at, part) in lines:
            at = (*at, part)
    return at, lines.get(at)


def _written(node: yaml.Node, at: Path_) -> str:
    """Return what stands in the file at a path if that is one value: ``yes``, not True; texts in quotes."""
    for part in at:
        children = node.value
        if isinstance(node, yaml.MappingNode):
            node = next(value for key, value in children if key.value == str(part))
        else:
            node = children[part]
    if not isinstance(node, yaml.ScalarNode):
        return ""
    is_text = node.tag == "tag:yaml.org,2002:str"
    return repr(node.value) if is_text else str(node.value)


def _siblings(error: ValidationError, loc: Path_, model: type[BaseModel]) -> set[str]:
    """Return the keys that the model of the unknown key's parent knows."""
    current: Any = model
    for part in loc[:-1]:
        current = _step(current, part)
        if current is None:
            return set()
    inside = [argument for argument in getattr(current, "__args__", ()) if hasattr(argument, "model_fields")]
    fields = getattr(inside[0] if len(inside) == 1 else current, "model_fields", {})
    return {field.alias or name for name, field in fields.items()}


def _step(current: Any, part: str | int) -> Any:
    """Return the model found under `part`, looking through unions, lists and dicts."""
    fields = getattr(current, "model_fields", None)
    if fields is not None:
        by_alias = {field.alias or name: field for name, field in fields.items()}
        return by_alias[str(part)].annotation if str(part) in by_alias else current
    arguments = [argument for argument in getattr(current, "__args__", ()) if argument is not type(None)]
    models = [argument for argument in arguments if hasattr(argument, "model_fields")]
    if isinstance(part, str) and len(models) > 1:
        for candidate in models:
            tags = [field.default for field in candidate.model_fields.values()]
            if part in tags or part == candidate.__name__:
                return candidate
    if arguments:
        return _step(arguments[-1], part) if not models else models[0]
    return None

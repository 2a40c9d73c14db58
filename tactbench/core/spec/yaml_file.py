"""Reading of YAML files into models, with errors that name the file and the line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from tactbench.core.errors import ConfigError, did_you_mean

M = TypeVar("M", bound=BaseModel)
Path_ = tuple[str | int, ...]
Places = dict[Path_, tuple[int, yaml.Node]]
"""Line and YAML node of every key and item, by its path in the file."""

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""PyYAML's loader in C, eight times as fast as the loader in Python, which is used if PyYAML was built without it."""
_INT, _FLOAT, _TEXT = (f"tag:yaml.org,2002:{name}" for name in ("int", "float", "str"))
_KEYS = (_INT, _TEXT, "tag:yaml.org,2002:merge")
_WHOLE = re.compile(r"-?[1-9][0-9]*|0")
_ODD_NUMBER = re.compile(r"[-+]?(0[0-9_]|[0-9][0-9_.]*[_:])")
"""Patterns of texts whose value in YAML 1.1 is a surprise: 010 is 8, 2025_04 is 202504, 1:30 is 90."""


def load_yaml(path: Path, model: type[M]) -> M:
    """Read the YAML file at `path` and return its content as a `model`.

    Raises ConfigError, which starts with ``file:line``, if the file cannot be read, is not YAML, repeats a key, has an
    unknown key (the nearest known one is offered), or a value that `model` refuses.
    """
    file = str(path)
    try:
        node, data = _loaded(path.read_text(encoding="utf-8"), file)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", "") or "it is not UTF-8 text"
        raise ConfigError(file, None, f"cannot be read: {reason}.", hint="Check the path and the file.") from error
    if node is None:
        raise ConfigError(file, None, "is empty.", hint="Write the settings into the file; docs/ has examples.")
    places: Places = {}
    _collect_places(node, (), places, file)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise _explain(error, file, places, model) from error


def plain_value(text: str) -> Any:
    """Return `text` as the number or truth value that it has in YAML, and any other text unchanged."""
    try:
        node, value = _loaded(text, "")
        _collect_places(node, (), {}, "")
    except ConfigError:
        return text
    return value if isinstance(value, str | int | float | bool) else text


def _loaded(text: str, file: str) -> tuple[Any, Any]:
    """Return the YAML node and the plain data of a text; raise ConfigError for invalid YAML."""
    try:
        loader = _LOADER(text)
        node = loader.get_single_node()
        return node, None if node is None else loader.construct_document(node)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        problem = getattr(error, "problem", None) or "is not YAML"
        raise ConfigError(file, mark.line + 1 if mark else None, f"{problem}.", hint="Check the syntax.") from error
    except (ValueError, RecursionError) as error:  # a number or date that is not valid, or brackets without end
        raise ConfigError(file, None, f"has values that cannot be read: {error}.", hint="Quote texts.") from error


def _collect_places(node: Any, at: Path_, places: Places, file: str) -> None:
    """Add every key and item to `places`; raise ConfigError for a value whose YAML meaning differs from its look."""
    line = node.start_mark.line + 1
    places.setdefault(at, (line, node))
    if isinstance(node, yaml.MappingNode):
        seen = set()
        for key_node, value_node in node.value:
            line, key = key_node.start_mark.line + 1, str(key_node.value)[:80]
            number = key_node.tag == _INT
            if key_node.tag not in _KEYS or (number and not _WHOLE.fullmatch(key)):
                raise ConfigError(
                    file, line, f"the key {key} is neither a word nor a whole number.", hint=f"Quote it: '{key}'."
                )  # fmt: skip
            if key in seen:
                raise ConfigError(file, line, f"the key {key!r} occurs twice.", hint="Remove one of them.")
            seen.add(key)
            place: Path_ = (*at, int(key) if number else key)
            places[place] = line, value_node
            _collect_places(value_node, place, places, file)
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            _collect_places(item, (*at, index), places, file)
    elif node.tag in (_INT, _FLOAT) and _ODD_NUMBER.match(node.value):
        written = node.value[:80]
        raise ConfigError(
            file, line, f"YAML reads {written} as a different number.",
            hint=f"Quote it if it is a word: '{written}'; else leave out leading zeros, _ and :.",
        )  # fmt: skip


def _explain(error: ValidationError, file: str, places: Places, model: type[BaseModel]) -> ConfigError:
    """Return pydantic's first complaint as an error that names the line in the file."""
    complaints = error.errors(include_url=False)
    # A misspelt key is both unknown and missing: the unknown one is what the writer sees on the page.
    first = next((one for one in complaints if one["type"] == "extra_forbidden"), complaints[0])
    loc = tuple(first["loc"])
    at: Path_ = ()
    for part in loc:  # pydantic adds the names of members of unions, which stand nowhere in the file
        at = (*at, part) if (*at, part) in places else at
    line, node = places[at]
    name = ".".join(str(part) for part in at) or "the file"
    if first["type"] == "extra_forbidden":
        schema = model.model_json_schema()
        parts = (schema, *schema.get("$defs", {}).values())
        meant = did_you_mean(str(loc[-1]), {key for part in parts for key in part.get("properties", {})}).strip()
        return ConfigError(file, line, f"the key {str(loc[-1])!r} is not known.", hint=meant or "Remove the key.")
    if first["type"] == "missing":
        return ConfigError(file, line, f"the key {str(loc[-1])!r} is missing in {name}.", hint="Add the key.")
    text = ""
    if isinstance(node, yaml.ScalarNode):  # as it is written: yes, not True, and texts in quotes
        text = repr(node.value) if node.tag == _TEXT else str(node.value)
    shown = f" (given: {text[:80]})" if text else ""
    message = first["msg"].removeprefix("Value error, ")
    return ConfigError(file, line, f"{name}: {message}{shown}.", hint="Correct the value.")

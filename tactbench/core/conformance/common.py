"""Checks of every plugin: its code can be found, its module is light, its descriptor is data that keeps."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import lru_cache
from importlib import metadata
from typing import Any

from pydantic import ValidationError

from tactbench.core.conformance.check import KINDS, check, fail, line_in, skip
from tactbench.core.conformance.subject import Subject
from tactbench.core.errors import PluginError
from tactbench.core.plugins.registry import load_object
from tactbench.core.spec.quantity import Source

HEAVY = frozenset({
    "can", "cv2", "dask", "distributed", "h5py", "jax", "matplotlib", "numba", "pandas", "pyarrow", "rclpy", "rich",
    "scipy", "serial", "sklearn", "spidev", "tensorflow", "torch", "transformers",
})  # fmt: skip
"""Packages that take tenths of a second to import, or that need not be installed where plugins are listed."""
IMPORT_S = 1.0
"""Seconds of CPU that the module of an entry point may take beyond tactbench.plugin: it is imported for every command.
Ours take 0.02 s; one that loads a table or trains something takes more than this on any machine."""


@check(*KINDS)
def code_names_resolve(subject: Subject) -> None:
    """Code is named by text and imported when it is needed, so that a slip of the pen shows in the middle of a run.

    Correct the ``module:attribute`` in the descriptor, or the module itself where its import fails.
    """
    if not subject.fields:
        skip("its descriptor names no code")
    for field, where in subject.fields.items():
        try:
            found = load_object(where)
        except PluginError as error:
            line = line_in(subject.package, error.__cause__.__traceback__ if error.__cause__ else None)
            fail(f"{field}{f' ({line})' if line else ''}", f"{where} cannot be loaded: {error.__cause__}")
        except Exception as error:
            fail(f"{field} ({line_in(subject.package, error.__traceback__)})", f"{type(error).__name__}: {error}")
        if not callable(found):
            fail(field, f"{where} is a {type(found).__name__}, and something that can be called is needed")


@check(*KINDS)
def import_is_light(subject: Subject) -> None:
    """The module of an entry point is imported by every command, also by one that only lists names.

    Move imports of large packages, and all that computes, into the module that the descriptor names, or into functions.
    """
    found = _import_cost(subject.module)
    if "error" in found:
        fail(subject.module, str(found["error"]))
    heavy = sorted(HEAVY.intersection(found["packages"]))
    if heavy:
        line = _line_of_import(subject.module, heavy[0])
        fail(f"{subject.module}{line}", f"its import also imports {', '.join(heavy)}")
    if found["cpu_s"] > IMPORT_S:
        fail(subject.module, f"its import takes {found['cpu_s']:.2g} s of CPU, and at most {IMPORT_S:g} s is allowed")


@lru_cache(maxsize=64)
def _import_cost(module: str) -> dict[str, Any]:
    """Import a module in a fresh interpreter; return the CPU seconds it takes, and the packages it brings."""
    code = (
        "import importlib, json, sys, time\n"
        "import tactbench.plugin, tactbench.plugin.simulation, tactbench.plugin.devices\n"
        "before, began = set(sys.modules), time.process_time()\n"
        f"importlib.import_module({module!r})\n"
        "spent = time.process_time() - began\n"
        "packages = sorted({name.partition('.')[0] for name in set(sys.modules) - before})\n"
        "print(json.dumps({'cpu_s': spent, 'packages': packages}))\n"
    )
    path = os.pathsep.join(part for part in sys.path if part)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], env={**os.environ, "PYTHONPATH": path}, capture_output=True,
        text=True, stdin=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    if done.returncode != 0:
        last = done.stderr.strip().rpartition("\n")[2]
        return {"error": f"it cannot be imported in a fresh interpreter: {last}"}
    found: dict[str, Any] = json.loads(done.stdout.strip().rpartition("\n")[2])
    return found


def _line_of_import(module: str, package: str) -> str:
    """Return `` (line N)`` where a module itself imports a package; "" where another one does it."""
    tree = ast.parse(inspect.getsource(importlib.import_module(module)))
    for node in ast.walk(tree):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        if any(name.partition(".")[0] == package for name in names):
            return f" (line {node.lineno})"  # type: ignore[attr-defined]
    return ""


@check(*KINDS)
def descriptor_cannot_change(subject: Subject) -> None:
    """Keys of results and recordings cover the descriptor as it was read; one that changes later makes them lie.

    Use tactbench.plugin's classes as they are, build them once at the top of the module, and give the same each time.
    """
    for model, where in ((subject.descriptor, "descriptor"), (getattr(subject.descriptor, "spec", None), "spec")):
        if model is not None and not type(model).model_config.get("frozen"):
            fail(where, f"its class {type(model).__name__} lets fields be set")
    first, second = (one.model_dump(mode="json") for one in (subject.descriptor, subject.asked_again()))
    place = difference(first, second)
    if place:
        fail(place, f"{subject.hook} gave something else when it was asked a second time")


@check(*KINDS)
def json_round_trip(subject: Subject) -> None:
    """Descriptors pass between processes and into recordings as JSON; what JSON cannot hold is lost or refused there.

    Use finite numbers, plain text and the fields of tactbench.plugin's classes only.
    """
    descriptor = subject.descriptor
    try:
        back = type(descriptor).model_validate_json(descriptor.model_dump_json())
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        fail(place_of(descriptor, first["loc"]), f"{first['msg']}, after a round trip through JSON")
    except ValueError as error:
        fail("descriptor", f"it cannot be written as JSON: {error}")
    place = difference(descriptor.model_dump(), back.model_dump())
    if place:
        fail(place, "it is another value after a round trip through JSON")


@check(*KINDS, level="silver")
def docs_are_present(subject: Subject) -> None:
    """A table shows a name; what it stands for, its reader looks up in the module and on the package's page.

    Give the module a docstring or the package a description, the descriptor a title, and a task a question.
    """
    spec = getattr(subject.descriptor, "spec", None)
    title = spec.title if spec is not None else subject.descriptor.title
    where = "title" if spec is None else "spec.title"
    if not title.strip() or "todo" in title.lower():
        fail(where, f"{title!r} says nothing")
    if subject.kind == "task" and not subject.descriptor.spec.question.strip().endswith("?"):
        fail("spec.question", f"{subject.descriptor.spec.question!r} is no question")
    try:
        summary = metadata.metadata(subject.distribution)["Summary"]
    except (metadata.PackageNotFoundError, KeyError):
        summary = None
    if not (importlib.import_module(subject.module).__doc__ or summary or "").strip():
        fail(subject.module, "it has no docstring, and its package no description in pyproject.toml")


@check("sensor", "task")
def sources_say_where(subject: Subject) -> None:
    """A number nobody can look up cannot be trusted, nor corrected.

    State the document, file or reason in the Source's reference; where there is none, use `assumed` and say why.
    """
    for place, value in walk(subject.descriptor.spec, "spec"):
        if isinstance(value, Source) and not value.reference.strip():
            fail(f"{place}.reference", f"it is empty: who says so? Its tag is {value.tag!r}")
    if subject.kind == "task":
        for number, one in enumerate(subject.descriptor.spec.published):
            if not one.reference.strip():
                fail(f"spec.published[{number}].reference", "it is empty: who published the figure?")


def walk(value: Any, place: str) -> Iterator[tuple[str, Any]]:
    """Yield every model, and every plain value, in a model with its place."""
    yield place, value
    if hasattr(type(value), "model_fields"):
        for field in type(value).model_fields:
            yield from walk(getattr(value, field), f"{place}.{field}")
    elif isinstance(value, dict):
        for key, one in value.items():
            yield from walk(one, f"{place}[{key}]")
    elif isinstance(value, (tuple, list)):
        for number, one in enumerate(value):
            yield from walk(one, f"{place}[{getattr(one, 'name', number)}]")


def difference(first: Any, second: Any, place: str = "spec") -> str:
    """Return the place at which two plain values differ first; "" if nowhere."""
    if isinstance(first, dict) and isinstance(second, dict):
        for key in {**first, **second}:
            found = difference(first.get(key), second.get(key), f"{place}.{key}")
            if found:
                return found
        return ""
    if isinstance(first, (list, tuple)) and isinstance(second, (list, tuple)) and len(first) == len(second):
        for number, (one, other) in enumerate(zip(first, second, strict=True)):
            found = difference(one, other, f"{place}[{number}]")
            if found:
                return found
        return ""
    same = first == second or (first != first and second != second)
    return "" if same else place.removeprefix("spec.") or place


def place_of(model: Any, way: tuple[str | int, ...]) -> str:
    """Return a place in a model by names: ``spec.streams[taxels].channels[t3].lower``."""
    text, value = "", model
    for part in way:
        if isinstance(part, int):
            value = value[part] if isinstance(value, (tuple, list)) and part < len(value) else None
            text += f"[{getattr(value, 'name', part)}]"
        else:
            value = value.get(part) if isinstance(value, dict) else getattr(value, part, None)
            text += f".{part}"
    return text.removeprefix(".")


CHECKS = (
    code_names_resolve, import_is_light, descriptor_cannot_change, json_round_trip, sources_say_where, docs_are_present,
)  # fmt: skip

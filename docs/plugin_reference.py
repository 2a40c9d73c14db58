"""The pages ``plugin-reference.md``, every name of the doors, and ``rig-files.md``, every field, from their docstrings.

Read from the source; nothing is imported. ``conf.py`` writes the pages when the site is built.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOORS = ("tactbench.plugin", "tactbench.plugin.simulation", "tactbench.plugin.devices")
_TAGS = frozenset({"assumed", "derived", "measured", "sourced"})
_TITLE = """# What a plugin imports

Generated from the docstrings. How plugins are written: [plugins](plugins.md).
"""
_MANIPULATOR = "tactbench.rigs.parallel_manipulator"
RIG_FILES = {
    "Every rig file": ("tactbench.core.spec.rig_file",),
    "Options of the BioTac": ("tactbench.sensors.biotac.frames",),
    "Options of the iCub fingertip": ("tactbench.sensors.icub.driver", "tactbench.sensors.icub.log"),
    "Options of net-ft": (f"{_MANIPULATOR}.net_ft.driver",),
    "Options of every axis": ("tactbench.devices.positioner",),
    "Options of faulhaber, beside those of every axis": (f"{_MANIPULATOR}.motor.codec",),
    "Settings of parallel-manipulator": (f"{_MANIPULATOR}.settings", f"{_MANIPULATOR}.kinematics"),
}
"""Chapters of ``rig-files.md`` and the modules whose models they describe."""
_MODELS = {"Frozen", "DeviceEntry", "NamedDevice", "RigFile", "Options", "PositionerOptions", "BaseModel", "_Part"}
"""Bases of the models of a rig file."""
_RIG_FILES_TITLE = """# Rig files

Generated from the docstrings. What a rig file is for: [devices](hardware.md).
"""


def reference() -> str:
    """Return ``plugin-reference.md``."""
    return "\n".join([_TITLE, *(text for door in DOORS for text in _door(door))])


def rig_files() -> str:
    """Return ``rig-files.md``."""
    parts = [_RIG_FILES_TITLE]
    for title, modules in RIG_FILES.items():
        parts.append(f"## {title}\n")
        for node in (node for module in modules for node in _parsed(module).body):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and _MODELS & set(_bases(node)):
                fields = "\n".join(_line(*field) for field in _fields(node))
                parts.append(f"### {node.name}\n\n{_markdown(ast.get_docstring(node))}\n\n{fields}\n")
    return "\n".join(parts)


def _door(door: str) -> Iterator[str]:
    """Yield a door's chapter: its names by the module they come from, in the order of that module."""
    tree = _parsed(door)
    public = ast.literal_eval(next(node.value for node in tree.body if _target(node) == "__all__"))
    came_from = {
        alias.name: node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
        if alias.name in public
    }
    yield f"## `{door}`\n\n{_markdown(ast.get_docstring(tree))}\n"
    for module in sorted(set(came_from.values())):
        source = _parsed(module)
        yield f"### {_markdown((ast.get_docstring(source) or '').partition(chr(10))[0]).rstrip('.')}\n"
        classes = {node.name: node for node in source.body if isinstance(node, ast.ClassDef)}
        for node, after in _statements(source.body):
            if came_from.get(_target(node)) == module:
                hidden = {one for one in _bases(node) if one in classes and came_from.get(one) != module}
                for base in hidden:
                    node.body += classes[base].body
                if isinstance(node, ast.ClassDef):
                    node.bases = [one for one in node.bases if ast.unparse(one) not in hidden]
                yield f"#### `{_target(node)}`\n\n{_described(node, after)}\n"


def _statements(body: list[ast.stmt]) -> Iterator[tuple[ast.stmt, ast.stmt | None]]:
    """Yield each statement with the one after it, those under a condition as well."""
    for node, after in zip(body, [*body[1:], None], strict=True):
        yield node, after
        if isinstance(node, ast.If):
            yield from _statements(node.body)


def _parsed(module: str) -> ast.Module:
    place = ROOT.joinpath(*module.split("."))
    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    return ast.parse(file.read_text(encoding="utf-8"))


def _target(node: ast.AST) -> str:
    """Return the name that a statement defines, or nothing."""
    if isinstance(node, ast.ClassDef | ast.FunctionDef):
        return node.name
    if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
        return node.targets[0].id
    if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
        return node.target.id
    return ""


def _described(node: ast.AST, after: ast.AST | None) -> str:
    """Return what stands below a name: its definition, and what its docstring says."""
    if isinstance(node, ast.FunctionDef):
        return f"`{_signature(node)}`\n\n{_markdown(ast.get_docstring(node))}"
    if isinstance(node, ast.ClassDef):
        bases = [base for base in _bases(node) if base != "Frozen"]
        kind = f"A kind of {', '.join(f'`{base}`' for base in bases)}. " if bases else ""
        members = "\n".join(_members(node))
        return f"{kind}{_markdown(ast.get_docstring(node))}" + (f"\n\n{members}" if members else "")
    assert isinstance(node, ast.Assign | ast.AnnAssign)
    value = "" if node.value is None else f"`{ast.unparse(node.value)}`\n\n"
    return value + _markdown(_text_of(after))


def _members(node: ast.ClassDef) -> Iterator[str]:
    """Yield a line for each public field, property and method."""
    for member, after in _statements(node.body):
        name = _target(member)
        if name.startswith("_") and name != "__call__":
            continue
        if isinstance(member, ast.AnnAssign):
            yield _line(_field(member), _text_of(after))
        elif isinstance(member, ast.Assign) and name != "model_config":
            yield _line(f"{name}{_default(member.value)}", _text_of(after))
        elif isinstance(member, ast.FunctionDef):
            kinds = {ast.unparse(one) for one in member.decorator_list}
            text = f"{name}: {ast.unparse(member.returns)}" if "property" in kinds and member.returns else None
            yield _line(text or _signature(member), ast.get_docstring(member))


def _fields(node: ast.ClassDef) -> Iterator[tuple[str, str | None]]:
    """Yield each annotated field with its description."""
    for member, after in _statements(node.body):
        if isinstance(member, ast.AnnAssign):
            yield _field(member), _text_of(after)


def _field(member: ast.AnnAssign) -> str:
    return f"{_target(member)}: {ast.unparse(member.annotation)}{_default(member.value)}"


def _bases(node: ast.AST) -> list[str]:
    return [ast.unparse(base) for base in getattr(node, "bases", ())]


def _line(code: str, text: str | None) -> str:
    description = re.sub(r"\n(?!\n)", "\n  ", _markdown(text))
    return f"- `{code}`" + (f": {description}" if description else "")


def _signature(node: ast.FunctionDef) -> str:
    arguments = re.sub(r"^self(, )?", "", ast.unparse(node.args))
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{node.name}({arguments}){returns}"


def _default(value: ast.expr | None) -> str:
    """Return a field's default: of a quantity number, unit and tag; of ``Field`` its default alone."""
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Name):
        if value.func.id in _TAGS:
            number, unit = (ast.literal_eval(argument) for argument in value.args[:2])
            return f" = {number:g} {unit} ({value.func.id})"
        if value.func.id in ("Field", "field"):
            given = {keyword.arg: keyword.value for keyword in value.keywords}
            if "default_factory" in given:
                return f" = {ast.unparse(given['default_factory'])}()"
            return _default(given.get("default"))
    return "" if value is None else f" = {ast.unparse(value)}"


def _text_of(node: ast.AST | None) -> str | None:
    """Return the text that stands by itself: the docstring of the field or alias before it."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
        return inspect.cleandoc(node.value.value)
    return None


def _markdown(text: str | None) -> str:
    """Return a docstring as Markdown: roles as code, the sections of numpydoc as lists."""
    text = re.sub(r":\w+:`~?([\w.]+)`", lambda found: f"`{found[1].rpartition('.')[2]}`", text or "")
    text = text.replace("``", "`")
    lines: list[str] = []
    section = ""
    source = text.split("\n")
    for line, below in zip(source, [*source[1:], ""], strict=True):
        if below and set(below) == {"-"}:
            section = line
            lines.append(f"**{line}**\n")
        elif line and set(line) == {"-"}:
            continue
        elif section and line and not line.startswith(" "):
            lines.append(f"- `{line}`:")
        else:
            lines.append(line.strip() if not section else f"  {line.strip()}".rstrip())
    return "\n".join(lines).strip()

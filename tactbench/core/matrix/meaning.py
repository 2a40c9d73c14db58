"""What a Python file means, without its comments, docstrings and formatting; and what it imports."""

from __future__ import annotations

import ast


def meaning_of(content: bytes) -> bytes:
    """Return the file's syntax tree as text, without docstrings; the bytes themselves if they are not Python."""
    try:
        tree = ast.parse(content)
        _without_docstrings(tree)
        return ast.dump(tree).encode("utf-8", "surrogatepass")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return content


def imports_of(content: bytes) -> list[str]:
    """Return the top-level packages that a file imports, sorted; of tactbench's own, the room: ``tactbench.rigs``.

    Also those of ``import_module("name")``; a name put together while the program runs cannot be seen.
    """
    try:
        nodes = list(ast.walk(ast.parse(content)))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            # `from tactbench import rigs` names the room only in its list.
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and _imports(node.func) and node.args:
            first = node.args[0]
            if isinstance(first, ast.Constant) and isinstance(first.value, str) and not first.value.startswith("."):
                found.add(first.value)
    return sorted({_room(name) for name in found})


def _room(name: str) -> str:
    package, _, rest = name.partition(".")
    if package != "tactbench" or not rest:
        return package
    first, _, second = rest.partition(".")
    return f"tactbench.{first}" + (f".{second.partition('.')[0]}" if first == "core" and second else "")


def _imports(function: ast.expr) -> bool:
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    return name in ("import_module", "__import__")


def _without_docstrings(tree: ast.Module) -> None:
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            inner = getattr(node, name, None)
            if isinstance(inner, list):
                waiting.extend(inner)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                del node.body[0]

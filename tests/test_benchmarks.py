"""Benchmarks, studies and scripts are run by hand: here it is held that what they import is there."""

import ast
import importlib
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]
SCRIPTS = [path for folder in ("benchmarks", "docs", "studies") for path in (CHECKOUT / folder).rglob("*.py")]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_what_a_script_imports_of_tactbench_is_there(script):
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tactbench"):
            module = importlib.import_module(node.module)
            for name in node.names:
                if not hasattr(module, name.name):
                    importlib.import_module(f"{node.module}.{name.name}")

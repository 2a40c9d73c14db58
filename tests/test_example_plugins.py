"""The packages of examples/plugins: they stand on the doors alone, and are as short as they say.

Their own tests need them installed: ``.ci/run`` does that. Here they are only read.
"""

import ast
import io
import tokenize
import tomllib

import pytest

from tests.conftest import ROOT

PACKAGES = sorted(path.parent for path in (ROOT / "examples" / "plugins").glob("*/pyproject.toml"))
DOORS = {"tactbench.plugin", "tactbench.plugin.simulation", "tactbench.plugin.devices"}
WITH_DRIVER, WITHOUT = 100, 40
"""The most lines of code that a package of a sensor may have."""


def sources(package):
    return sorted(path for path in package.rglob("*.py") if "tests" not in path.parts)


def imported(path):
    """Return the modules that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            yield node.module


def lines_of_code(path):
    """Return how many lines hold code: no blank line, comment or docstring."""
    text = path.read_text(encoding="utf-8")
    silent = {
        line
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None
        for line in range(node.body[0].lineno, node.body[0].end_lineno + 1)
    }
    kinds = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    found = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in kinds:
            found.update(range(token.start[0], token.end[0] + 1))
    return len(found - silent)


def test_there_are_sensors_tasks_and_effects():
    assert len(PACKAGES) >= 6


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_it_imports_the_doors_alone(package):
    of_ours = {name for path in sources(package) for name in imported(path) if name.partition(".")[0] == "tactbench"}
    assert of_ours
    assert of_ours <= DOORS
    tested_with = {name for path in (package / "tests").glob("*.py") for name in imported(path)}
    assert {name for name in tested_with if name.partition(".")[0] == "tactbench"} <= DOORS | {"tactbench.testing"}


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_it_is_as_short_as_it_says(package):
    files = sources(package)
    most = WITH_DRIVER if any(path.name == "driver.py" for path in files) else WITHOUT
    assert sum(map(lines_of_code, files)) < most


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_its_entry_point_names_its_package(package):
    with (package / "pyproject.toml").open("rb") as file:
        (module,) = tomllib.load(file)["project"]["entry-points"]["tactbench"].values()
    assert (package / module / "__init__.py").is_file()
    assert f"`{package.name}`" in (package.parent / "README.md").read_text(encoding="utf-8")

"""The doors: every name resolves, is used by a plugin and stands in the reference; a listing imports nothing heavy."""

import ast
import re
import runpy
import subprocess
import sys
from collections import Counter
from importlib import import_module

import pytest

from tests.conftest import ROOT, THIRD_PARTY

DOORS = ("tactbench.plugin", "tactbench.plugin.simulation", "tactbench.plugin.devices")
PLUGINS = [*(ROOT / "tactbench" / family for family in ("sensors", "rigs", "tasks", "estimators")), THIRD_PARTY]
PLUGINS.append(ROOT / "examples" / "plugins")


def used_by_plugins():
    """Every (door, name) that plugins import, ours and those of the tests."""
    files = (file for folder in PLUGINS for file in folder.rglob("*.py"))
    nodes = (node for file in files if "broken" not in file.parts for node in ast.walk(ast.parse(file.read_text())))
    return {
        (node.module, alias.name)
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module in DOORS
        for alias in node.names
    }


def chapters():
    """The reference's entries by door and name."""
    by_door = {}
    written = runpy.run_path(str(ROOT / "docs" / "plugin_reference.py"))["reference"]()
    for chapter in re.split(r"^## ", written, flags=re.M)[1:]:
        door = chapter.split("`")[1]
        by_door |= {
            (door, name): text for name, text in re.findall(r"^#### `(\w+)`\n(.*?)(?=^#|\Z)", chapter, re.M | re.S)
        }
    return by_door


@pytest.mark.parametrize("door", DOORS)
def test_every_name_can_be_imported(door):
    module = import_module(door)
    assert [name for name in module.__all__ if not hasattr(module, name)] == []
    with pytest.raises(ImportError, match="Nothing"):
        exec(f"from {door} import Nothing")
    with pytest.raises(AttributeError, match=f"{door}.*Nothing"):
        _ = module.Nothing


def test_a_name_is_in_one_door():
    names = Counter(name for door in DOORS for name in import_module(door).__all__)
    assert [name for name, times in names.items() if times > 1] == []


def test_what_no_plugin_uses_is_in_no_door():
    offered = {(door, name) for door in DOORS for name in import_module(door).__all__}
    # A plugin states the version that it was written for, not the one that it meets.
    assert offered - used_by_plugins() == {("tactbench.plugin", "API_VERSION")}
    assert used_by_plugins() - offered == set()


def test_no_name_is_missing_in_the_reference_or_without_a_word_about_it():
    described = chapters()
    assert set(described) == {(door, name) for door in DOORS for name in import_module(door).__all__}
    bare = [name for name, text in described.items() if not re.sub(r"`[^`]*`|A kind of [^.]*\.", "", text).strip()]
    assert bare == []


def test_a_plugin_that_is_only_listed_imports_neither_numpy_nor_links():
    code = f"import sys, {', '.join(DOORS)}; print(*sys.modules)"
    modules = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60, cwd=ROOT
    ).stdout.split()
    heavy = {"numpy", "scipy", "h5py", "serial", "can", "tactbench.devices.driver", "tactbench.links.link"}
    assert heavy & set(modules) == set()

"""The core does nothing by the name of a sensor, a task or a rig: it asks the registry."""

import ast
from typing import get_args

from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.sensor import ChannelKind
from tests.conftest import ROOT

CORE = ROOT / "tactbench" / "core"


def constants(tree):
    """Yield the constants of a module outside decorators, which name verbs."""
    nodes = [tree]
    for node in nodes:
        if isinstance(node, ast.Constant):
            yield node
        nodes += [one for one in ast.iter_child_nodes(node) if one not in getattr(node, "decorator_list", ())]


def test_the_core_names_no_sensor_task_or_rig():
    registry = load_registry()
    families = (registry.sensors, registry.tasks, registry.rigs)
    # Tasks may be called after what a channel or a target is of.
    names = {name for family in families for name in family.names()} - {"slip", *get_args(ChannelKind)}
    paths = [
        path for path in CORE.rglob("*.py") if path != CORE / "cli" / "__init__.py"
    ]  # a verb is called as a rig is
    found = [(path.name, node.lineno) for path in paths for node in constants(ast.parse(path.read_text()))
             if node.value in names]  # fmt: skip
    assert found == []

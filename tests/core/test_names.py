"""The core does nothing by the name of a sensor, a task or a rig: it asks the registry."""

import ast
from typing import get_args

from tactbench.core.plugins.registry import load_registry
from tactbench.core.spec.sensor import ChannelKind
from tests.conftest import ROOT

CORE = ROOT / "tactbench" / "core"
VERBS = CORE / "cli" / "__init__.py"
"""Says which verbs there are: one is called as a rig is."""
QUANTITIES = {"slip", *get_args(ChannelKind)}
"""What a channel or a target is of, and tasks are called after."""


class Named(ast.NodeVisitor):
    """Collects the texts of a module that are a name; those of quantities only where the registry is asked for them."""

    def __init__(self, registry):
        self.families = {name: family.names() for name, family in registry.families().items()}
        names = {name for family in ("sensors", "tasks", "rigs") for name in self.families[family]}
        self.names, self.found = names - QUANTITIES, []

    def visit_FunctionDef(self, node):  # what a verb is called is no name of a plugin
        for one in (node.args, *node.body):
            self.visit(one)

    def visit_Subscript(self, node):
        family = self.families.get(getattr(node.value, "attr", ""), ())
        if isinstance(node.slice, ast.Constant) and node.slice.value in family:
            self.found.append((node.lineno, node.slice.value))
        self.generic_visit(node)

    def visit_Constant(self, node):
        if node.value in self.names:
            self.found.append((node.lineno, node.value))


def named(source, registry):
    visitor = Named(registry)
    visitor.visit(ast.parse(source))
    return visitor.found


def test_the_core_names_no_sensor_task_or_rig():
    registry = load_registry()
    found = {str(path): named(path.read_text(), registry) for path in CORE.rglob("*.py") if path != VERBS}
    assert {path: names for path, names in found.items() if names} == {}

"""``tactbench new``: writes a plugin package to start from."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path
from string import Template

import click

from tactbench.core.errors import UsageError
from tactbench.core.plugins.hookspecs import API_VERSION
from tactbench.core.plugins.registry import load_registry

KINDS = ("sensor", "rig", "task", "estimator", "effect")
NAME = r"[a-z][a-z0-9]*(-[a-z0-9]+)*"
_OPTIONS = {"rig": "--sensor ideal --task force --rig", "task": "--sensor ideal --task",
            "estimator": "--sensor ideal --task force --estimator", "effect": "--sensor ideal --task force --effects",
            "sensor": "--task contact-location --sensor"}  # fmt: skip
"""Options of ``tactbench run`` that try a new plugin, by its kind; the name of the plugin is appended."""


@click.command(name="new")
@click.argument("kind", type=click.Choice(KINDS))
@click.argument("name")
@click.option("--into", type=click.Path(path_type=Path, file_okay=False), default=Path(), metavar="DIR",
              help="Folder of the package; created if missing.")  # fmt: skip
def command(kind: str, name: str, into: Path) -> None:
    """Write an installable package with a plugin that already runs: a sensor, rig, task, estimator or effect.

    NAME is lower case, with hyphens. Nothing is overwritten. See docs/tutorial.md.
    """
    if not re.fullmatch(NAME, name) or name == "all":
        raise UsageError(
            f"{name!r} is not a valid name for a {kind}.",
            hint=f"Use lower-case letters, digits and single hyphens, a letter first, not `all`; example: my-{kind}.",
        )
    if name in load_registry().families()[f"{kind}s"]:
        raise UsageError(f"A {kind} called {name} is installed already.", hint="Choose another name.")
    package = rendered(kind, name)
    taken = [path for path in package if (into / path).exists()]
    if taken:
        raise UsageError(f"{into / taken[0]} exists already.", hint="Give an empty folder: --into DIR.")
    for path, text in package.items():
        (into / path).parent.mkdir(parents=True, exist_ok=True)
        (into / path).write_text(text, encoding="utf-8")
        click.echo(into / path)
    here = "" if into == Path() else f"cd {into} && "
    option = f"{_OPTIONS[kind]} {'+' * (kind == 'effect')}{name}"
    click.echo(f"Try next:\n  {here}pip install -e .\n  tactbench check {name}\n  tactbench run {option}", err=True)


def rendered(kind: str, name: str) -> dict[str, str]:
    """Return the texts of the files of a new plugin package, by path."""
    module = f"tactbench_{name.replace('-', '_')}"
    words = {"kind": kind, "name": name, "module": module, "distribution": f"tactbench-{name}",
             "title": name.replace("-", " ").capitalize(), "api": str(API_VERSION)}  # fmt: skip
    places = {"pyproject.toml": "pyproject.toml", "README.md": "README.md", "ci.yaml": ".github/workflows/test.yaml",
              "test.py": f"tests/test_{module}.py"}  # fmt: skip
    found = {}
    for folder in ("common", kind):
        for file in sorted(files("tactbench").joinpath("templates", folder).iterdir(), key=lambda file: file.name):
            template = file.name.removesuffix(".txt")
            text = Template(file.read_text(encoding="utf-8")).substitute(words)
            found[places.get(template, f"{module}/{template}")] = text
    return found

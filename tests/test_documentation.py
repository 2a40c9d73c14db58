"""Every page is found from the index, every link leads somewhere, and the floors drawn are those that are held."""

import re
import runpy
import tomllib
from pathlib import Path
from types import ModuleType

import click
import pluggy
import pytest

from tactbench.core.cli import VERBS, cli
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.registry import _KINDS, load_registry

CHECKOUT = Path(__file__).parents[1]
PAGES = sorted((CHECKOUT / "docs").rglob("*.md"))


def links(page):
    """Return the files that a page links to."""
    found = re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    return [(page.parent / link).resolve() for link in found if "://" not in link]


@pytest.mark.parametrize("page", [CHECKOUT / "README.md", *PAGES], ids=lambda path: path.name)
def test_every_link_leads_to_a_file(page):
    assert [link for link in links(page) if not link.exists()] == []


def test_every_page_is_in_the_index():
    index = CHECKOUT / "docs" / "index.md"
    decisions = CHECKOUT / "docs" / "decisions" / "README.md"
    listed = {index.resolve(), *links(index), *links(decisions)}
    assert [page.name for page in PAGES if page.resolve() not in listed] == []
    assert index.resolve() in links(CHECKOUT / "README.md")


def test_the_floors_of_the_core_are_those_that_are_held():
    with (CHECKOUT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    (floors,) = [one["layers"] for one in contracts if one["name"] == "The floors of the core"]
    rooms = [name for floor in floors for name in re.findall(r"\w+", floor)]
    (drawn,) = re.findall(r"```\n(cli\n.*?)```", (CHECKOUT / "docs" / "architecture.md").read_text(), re.DOTALL)
    stated = [re.split(r"\s{2,}", line)[0] for line in drawn.splitlines()]
    assert [name for line in stated for name in line.split(" · ")] == rooms


def test_every_hook_has_an_example_that_works():
    page = (CHECKOUT / "docs" / "hooks.md").read_text(encoding="utf-8")
    chapters = dict(re.findall(r"^## `(\w+)`\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL))
    hooks = [name for name in vars(hookspecs) if name.startswith("tactbench_")]
    assert list(chapters) == hooks
    for hook, text in chapters.items():
        (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
        module = ModuleType("example")
        exec(code, vars(module))
        assert hookspecs.API_VERSION == module.TACTBENCH_API
        manager = pluggy.PluginManager(hookspecs.GROUP)
        manager.add_hookspecs(hookspecs)
        manager.register(module)
        manager.check_pending()
        ((descriptor,),) = getattr(manager.hook, hook)()
        assert isinstance(descriptor, _KINDS[hook.removeprefix("tactbench_")])


def test_every_effect_stands_in_the_table_with_its_tokens():
    page = (CHECKOUT / "docs" / "effects.md").read_text(encoding="utf-8")
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| `")]
    stated = {row[0].strip("`"): [re.findall(r"`([\w-]+)`", cell) for cell in row[2:]] for row in rows if len(row) == 5}
    effects = load_registry().effects
    assert stated == {one.name: [list(one.consumes), list(one.produces), list(one.groups)] for one in effects}


def test_the_page_of_commands_is_what_help_shows():
    # Made by: python docs/command_reference.py
    made = runpy.run_path(str(CHECKOUT / "docs" / "command_reference.py"))["reference"]()
    assert (CHECKOUT / "docs" / "commands.md").read_text(encoding="utf-8") == made


def test_no_verb_or_option_is_missing_from_the_page_of_commands():
    page = (CHECKOUT / "docs" / "commands.md").read_text(encoding="utf-8")
    chapters = dict(re.findall(r"^##+ `tactbench ([\w -]+)`\n(.*?)(?=^##|\Z)", page, re.MULTILINE | re.DOTALL))
    context = click.Context(cli)
    missing = []
    for verb in VERBS:
        for param in cli.get_command(context, verb).params:
            if isinstance(param, click.Option) and not all(name in chapters.get(verb, "") for name in param.opts):
                missing.append(f"{verb} {param.opts}")
    assert missing == []
    assert set(VERBS) <= set(chapters)

"""Every page is found; links, commands, files and imports on pages exist; scores of the README are those held."""

import ast
import importlib
import json
import re
import runpy
import statistics
import tomllib
from pathlib import Path
from types import ModuleType

import click
import pluggy
import yaml

from tactbench.core.cli import cli
from tactbench.core.plugins import hookspecs
from tactbench.core.plugins.registry import _KINDS, load_registry
from tactbench.core.spec.rig_file import RigFile
from tactbench.core.spec.yaml_file import load_yaml

CHECKOUT = Path(__file__).parents[1]
README = CHECKOUT / "README.md"
GENERATED = {"commands.md", "parameters.md", "plugin-reference.md", "rig-files.md"}
"""Pages that a build of the site leaves beside the others."""
PAGES = sorted(page for page in (CHECKOUT / "docs").rglob("*.md") if page.name not in GENERATED)
CURRENT = [README, *(page for page in PAGES if page.parent.name != "decisions")]
"""What is true of the present code; a decision tells what was true when it was taken."""
NAMING = (
    "emulation", "execution", "format", "glossary", "hardware", "hooks", "mappings", "plugins", "python", "results",
    "stability", "tables",
)  # fmt: skip
"""Pages on keys, fields, options and functions."""
FENCE = re.compile(r"^ *```(\w*)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)


def links(page):
    """Return the files that a page links to."""
    found = re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    return [(page.parent / link).resolve() for link in found if "://" not in link]


def blocks(page, *kinds):
    """Return the fenced blocks of a page that are of one of the kinds."""
    return [text for kind, text in FENCE.findall(page.read_text(encoding="utf-8")) if kind in kinds]


def commands(page):
    """Return the commands of a page as words after ``tactbench``: lines of shell blocks, and code within texts."""
    lines = [line for text in blocks(page, "", "sh") for line in text.replace("\\\n", " ").splitlines()]
    spans = re.findall(r"`([^`]+)`", FENCE.sub("", page.read_text(encoding="utf-8")))
    parts = [part.partition(" #")[0].split() for code in lines + spans for part in re.split("&&|;", code)]
    return [part[1:] for part in parts if len(part) > 1 and part[0].removeprefix(".venv/bin/") == "tactbench"]


def unknown(words):
    """Return the first word of a command that is no verb or option; None if there is none. VERB and … stand for any."""
    command, context = cli, click.Context(cli)
    while isinstance(command, click.Group) and words and not words[0].startswith("-"):
        if re.fullmatch(r"[A-Z]+|…", words[0]):
            return None
        if words[0] not in command.list_commands(context):
            return words[0]
        command, words = command.get_command(context, words[0]), words[1:]
    known = {name for param in command.get_params(context) for name in (*param.opts, *param.secondary_opts)}
    return next((word for word in words if re.match("-+[a-z]", word) and word.partition("=")[0] not in known), None)


def test_every_link_leads_to_a_file():
    assert [link for page in (README, *PAGES) for link in links(page) if not link.exists()] == []


def test_every_command_has_its_verb_and_options():
    assert [(page.name, words) for page in CURRENT for words in commands(page) if unknown(words)] == []


def test_every_file_of_the_repository_that_is_named_exists():
    named = re.compile(r"`((?:benchmarks|examples|firmware|studies|tactbench|tests/recordings)/[\w./-]+)`")
    found = [(page.name, name) for page in CURRENT for name in named.findall(page.read_text(encoding="utf-8"))]
    assert [(page, name) for page, name in found if not (CHECKOUT / name).exists()] == []


def test_every_key_field_and_function_that_is_named_is_in_the_sources():
    sources = " ".join(path.read_text(encoding="utf-8") for path in (CHECKOUT / "tactbench").rglob("*.py"))
    known = set(re.findall(r"\w+", sources))
    for page in (CHECKOUT / "docs" / f"{name}.md" for name in NAMING):
        spans = " ".join(re.findall(r"`([^`/]+)`", FENCE.sub("", page.read_text(encoding="utf-8"))))
        named = set(re.findall(r"\b[a-z]+(?:_[a-z0-9]+)+\b", spans))
        shown = set(re.findall(r"\w+", " ".join(blocks(page, "python", "sql", "yaml"))))
        assert sorted(named - known - shown) == [], page.name


def test_every_name_that_a_block_imports_is_there():
    trees = [ast.parse(text) for page in CURRENT if page.name != "tutorial.md" for text in blocks(page, "python")]
    for node in (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)):
        if node.module.startswith("tactbench."):
            module = importlib.import_module(node.module)
            assert [one.name for one in node.names if not hasattr(module, one.name)] == []


def test_every_rig_file_that_is_shown_is_read(tmp_path):
    texts = [text for page in CURRENT for text in blocks(page, "yaml") if "rig" in yaml.safe_load(text)]
    for number, text in enumerate(texts):
        path = tmp_path / f"{number}.yaml"
        path.write_text(text, encoding="utf-8")
        load_yaml(path, RigFile)
    assert texts


def test_every_page_is_in_the_index():
    index = CHECKOUT / "docs" / "index.md"
    decisions = CHECKOUT / "docs" / "decisions" / "README.md"
    listed = {index.resolve(), *links(index), *links(decisions)}
    assert [page.name for page in PAGES if page.resolve() not in listed] == []
    assert index.resolve() in links(README)


def test_the_generated_pages_have_every_verb_and_field():
    written = runpy.run_path(str(CHECKOUT / "docs" / "command_reference.py"))["reference"]()
    assert [verb for verb in cli.list_commands(click.Context(cli)) if f"\n## `tactbench {verb}`\n" not in written] == []
    written = runpy.run_path(str(CHECKOUT / "docs" / "parameter_reference.py"))["reference"]()
    assert re.search(r"^\| taxel_white_count \| .* \| measured: \w+", written, re.MULTILINE)
    written = runpy.run_path(str(CHECKOUT / "docs" / "plugin_reference.py"))["rig_files"]()
    for name in ("zero_s", "batches_ahead", "skin_type", "rate_hz", "lower_m", "homing", "link_mm"):
        assert re.search(rf"^- `{name}: .*`: .", written, re.MULTILINE), name


def test_the_rows_of_the_readme_are_those_of_the_board_and_of_the_frozen_scores():
    text = README.read_text(encoding="utf-8")
    board = (CHECKOUT / "docs" / "real-board.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (.*?) \| .*? \| ([\w-]+) \| [A-Za-z ]*([\d.]+)(?: \w+)? \| ([\d.]*)", text, re.MULTILINE)
    real = [row for row in rows if row[0].endswith("?")]
    assert len(real) == 7
    for question, estimator, score, low in real:
        there = re.findall(rf"^\|.*? {estimator}\S* [^|]*\| ([\d.]+)[^|]*\| ([\d.]*)", board, re.MULTILINE)
        assert (score, low) in [(rounded(one, score), rounded(other, low)) for one, other in there], question
    places = re.findall(r"^(\| [\d=]+ \| fluid-\S+ \| \S+ \| [\d.]+) N (\| .* \|)$", text, re.MULTILINE)
    assert len(places) == 9
    assert [row for row, interval in places if f"{row} {interval}" not in board] == []
    frozen = json.loads((CHECKOUT / "tests" / "frozen" / "default.json").read_text(encoding="utf-8"))
    simulated = re.findall(r"^\| [\d=]+ \| (\w+) \| (\w+) \| ([\d.]+)", text, re.MULTILINE)
    assert len(simulated) == 4
    for sensor, estimator, score in simulated:
        cell = re.compile(rf"{sensor}/curvature/twin/karl2016/{estimator}/\d")
        median = statistics.median(row["score"] for name, row in frozen.items() if cell.fullmatch(name))
        assert f"{median:.3f}" == score, (sensor, estimator)


def test_the_sensitivity_of_the_readme_is_that_of_its_page_and_of_the_frozen_scores():
    page = (CHECKOUT / "docs" / "calibration.md").read_text(encoding="utf-8")
    text = README.read_text(encoding="utf-8")
    lines = re.findall(r"^\| (?:as stated|offset_scale|placement_).*\|$", text, re.MULTILINE)
    assert len(lines) >= 3
    assert [line for line in lines if line not in page] == []
    (campaigns,) = re.findall(r"^#+ curvature · .* · forest · (\d+) campaigns", page, re.MULTILINE)
    frozen = json.loads((CHECKOUT / "tests" / "frozen" / "default.json").read_text(encoding="utf-8"))
    for sensor in ("biotac", "icub"):
        seeds = range(1, int(campaigns) + 1)
        scores = [frozen[f"{sensor}/curvature/twin/karl2016/forest/{seed}"]["score"] for seed in seeds]
        assert f" {statistics.median(scores):.3f} |" in lines[0], sensor


def rounded(number, like):
    """Return a number as text with the decimals of another one."""
    return f"{float(number):.{len(like.partition('.')[2])}f}" if number and like else number


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

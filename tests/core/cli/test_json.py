"""``--format json``: whatever prints it prints one JSON document and nothing else on stdout."""

import json
from pathlib import Path

import click
import pytest

from tactbench.core.cli import cli
from tests.conftest import Verbs
from tests.core.report.unrendered import unrendered

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "rigs" / "emulated.yaml"
CELL = "ideal/force/twin/karl2016/ols/1"
VERBS = {
    "run": ("--sensor", "ideal", "--task", "force", "--estimator", "ols", "--protocol", "karl2016", "--repeats", "1"),
    "list": (),
    "show": ("biotac", "icub", "force"),
    "choose": ("--task", "force"),
    "inspect": ("ideal.h5",),
    "check": ("ideal",),
    "doctor": ("--rig-file", str(EXAMPLE), "--seconds", "0"),
    "datasets": (),
    "leaderboard": (),
    "report": (),
    "compare": ("ols", "mean"),
    "why": (CELL,),
    "cost": ("--sensor", "ideal", "--task", "force", "--estimator", "ols", "--rounds", "1"),
    "twin explain": ("--sensor", "icub", "--task", "force", "--rounds", "0"),
    "twin verify": (),
}
"""What is asked of each verb that knows the format."""


@pytest.fixture(scope="module")
def there(tmp_path_factory):
    """The verbs in the folder of a run and of a recording."""
    verbs = Verbs(tmp_path_factory.mktemp("json"), here=True)
    verbs("run", *VERBS["run"])
    verbs("record", "--sensor", "ideal", "--profile", "ramp:duration=1", "--out", "ideal.h5")
    return verbs


def test_every_verb_that_knows_the_format_is_asked():
    knows = set()
    for words, verb in _verbs(cli, ()):
        for option in verb.params:
            if "--format" in option.opts and "json" in getattr(option.type, "choices", ()):
                knows.add(" ".join(words))
    assert knows == set(VERBS)


def _verbs(command, words):
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            yield from _verbs(command.get_command(context, name), (*words, name))
    else:
        yield words, command


@pytest.mark.parametrize("verb", VERBS)
def test_what_is_printed_is_json(there, verb):
    with unrendered():
        found = json.loads(there(*verb.split(), *VERBS[verb], "--format", "json").stdout)
    assert found, "and it says something"

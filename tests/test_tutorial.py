"""The tutorial, command by command and edit by edit: a sensor with its own geometry stands in the leaderboard.

In place of ``pip install -e .`` the test leaves what an installer leaves beside a package: it needs no network.
"""

import re
import shlex

import pytest

from tactbench.core.recording.reader import read_meta
from tests.conftest import ROOT, Verbs
from tests.core.cli.test_new import install

PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(sh|python)\n(.*?)```", PAGE, re.DOTALL)
COMMANDS = [line for kind, text in BLOCKS if kind == "sh" for line in text.splitlines()]
CODE = [text for kind, text in BLOCKS if kind == "python"]
INSTALL = "pip install -e ."
OF_THEIR_OWN = {"check"}
"""Verbs that carry out a plugin's code in a process of their own."""


def test_it_takes_at_most_ten_commands_and_forty_lines():
    # With the one of the README that installs tactbench itself.
    assert 1 + len(COMMANDS) <= 10
    assert sum(bool(line.strip()) and not line.startswith("#") for text in CODE for line in text.splitlines()) <= 40


def edit(folder, text):
    """Change a file as the first line of a block says."""
    told, _, code = text.partition("\n")
    path, where = re.fullmatch(r"# (\S+): (.*)", told).groups()
    lines = (folder / path).read_text(encoding="utf-8").splitlines(keepends=True)
    if where.startswith("before "):
        first = next(n for n, line in enumerate(lines) if line.startswith(where.removeprefix("before ").strip('"')))
        lines.insert(first, code)
    else:
        names = where.removeprefix("in place of ").split(", ")
        old = [next(n for n, line in enumerate(lines) if re.match(rf"\s*{name} ?=", line)) for name in names]
        lines[old[0]] = code
        lines = [line for n, line in enumerate(lines) if n not in old[1:]]
    (folder / path).write_text("".join(lines), encoding="utf-8")


@pytest.mark.timeout(600)  # two checks of a sensor in processes of their own, and two runs
def test_the_page_as_it_is_written(tmp_path):
    folder = tmp_path / "ring-pad"
    folder.mkdir()
    verbs, isolated = Verbs(folder, here=True), Verbs(folder)
    plugins, said = (), {}
    for kind, text in BLOCKS:
        if kind == "python":
            edit(folder, text)
            continue
        for line in text.splitlines():
            if line == INSTALL:
                install(folder, "ring-pad")
                plugins = (str(folder),)
                continue
            program, *words = shlex.split(line)
            assert program == "tactbench"
            call = isolated if words[0] in OF_THEIR_OWN else verbs
            said[line] = call(*words, plugins=plugins).stdout
    assert "ring-pad" in said[COMMANDS[2]]
    assert {"ring-pad", "ideal"} <= set(said["tactbench leaderboard"].split())
    # Both runs are of one folder: the one before the edit recorded 16 taxels in a square, the one after it 19 on rings.
    recordings = (folder / "tactbench-results" / "recordings" / "ring-pad").glob("*.h5")
    assert {len(read_meta(path).sensor.streams[0].channels) for path in recordings} == {16, 19}

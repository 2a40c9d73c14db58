"""Names from a stranger's file are shown, never acted on by a terminal."""

import json

import numpy as np
import pytest

from tests.core.evaluation.made import record

TITLE = "\x1b]0;owned\x07"
"""Sets the title of a terminal; not one of the sequences that are taken out of a stream that is no terminal."""


def acting(text):
    return [character for character in text if not character.isprintable() and character != "\n"]


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / f"{TITLE}.h5"
    return record(
        path, np.random.default_rng(0).normal(size=(30, 2)), np.arange(30.0), session=f"a{TITLE}",
        labels={f"b{TITLE}": f"c{TITLE}"}, annotations={"d": [f"e{TITLE}"] * 30}, remarks=(f"f{TITLE}\x9b31m",),
    )  # fmt: skip


def test_inspect_and_errors_show_them_and_json_holds_them_escaped(recording, verbs):
    shown = verbs("inspect", str(recording))
    assert acting(shown.stdout) == acting(shown.stderr) == []
    assert all(f"{letter}\\x1b]0;owned\\x07" in shown.stdout for letter in "abcef")
    text = verbs("inspect", str(recording), "--format", "json").stdout
    assert acting(text) == []
    assert json.loads(text)[0]["meta"]["session"] == f"a{TITLE}"
    shown = verbs("inspect", f"none{TITLE}.h5", code=2).stderr
    assert acting(shown) == []
    assert "none\\x1b]0;owned\\x07.h5" in shown

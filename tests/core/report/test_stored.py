"""Numbers computed once are found again by what decides them, and made anew where their file is damaged."""

import json

import pytest

from tactbench.core.report.embedding import stored

FACTS = {"of": "a", "points": 3}
NUMBERS = {"xy": [0.1, 1 / 3]}


def never():
    raise AssertionError("computed again")


@pytest.fixture
def kept(tmp_path):
    assert stored(tmp_path, "kind", FACTS, lambda: NUMBERS) == NUMBERS
    (file,) = (tmp_path / "report" / "kind").iterdir()
    return file


def test_the_same_facts_give_what_was_computed_and_other_facts_do_not(kept, tmp_path):
    assert stored(tmp_path, "kind", FACTS, never) == NUMBERS
    assert stored(tmp_path, "kind", {**FACTS, "points": 4}, dict) == {}
    assert stored(tmp_path, "other", FACTS, dict) == {}


@pytest.mark.parametrize(
    "damage", [b"", b"\xff", b'{"facts": ', json.dumps({"facts": {}, "numbers": {}}).encode(), b'{"facts": 1}', b"[]"]
)
def test_a_damaged_file_is_made_anew(kept, tmp_path, damage):
    whole = kept.read_bytes()
    kept.write_bytes(damage)
    assert stored(tmp_path, "kind", FACTS, lambda: NUMBERS) == NUMBERS
    assert kept.read_bytes() == whole


def test_a_folder_that_cannot_be_written_costs_the_time_alone(tmp_path):
    (tmp_path / "report").write_text("a file")
    assert stored(tmp_path, "kind", FACTS, lambda: NUMBERS) == NUMBERS

"""The files of a leaderboard in a result folder."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.formats import write_tables

from .rows import row


@pytest.fixture
def rows():
    return [row(key="1"), row("b", score=0.7, key="2"), row("c", status="failed", score=None, reason="no")]


def test_the_same_rows_in_any_order_give_the_same_bytes(rows, tmp_path):
    paths = write_tables(rows, tmp_path, [{"host": "h"}])
    assert {path.suffix for path in paths} == {".md", ".csv", ".json"}
    first = [path.read_bytes() for path in paths]
    apart = [one | {"assumptions": dict(one["assumptions"])} for one in rows[::-1]]
    assert [path.read_bytes() for path in write_tables(apart, tmp_path, [{"host": "h"}])] == first


def test_other_provenance_is_told_and_a_file_that_was_changed_or_is_gone_is_made_anew(rows, tmp_path):
    paths = write_tables(rows, tmp_path)
    first = [path.read_bytes() for path in paths]
    write_tables(rows, tmp_path, [{"host": "h", "cpu": "c"}])
    assert "Host h: c" in (tmp_path / "leaderboard.md").read_text()
    paths[0].write_text("mine")
    paths[1].unlink()
    assert [path.read_bytes() for path in write_tables(rows, tmp_path)] == first


def test_a_folder_that_refuses_is_a_sentence(rows, tmp_path):
    (tmp_path / "leaderboard.csv").mkdir()
    with pytest.raises(UsageError, match="tables cannot be written"):
        write_tables(rows, tmp_path)

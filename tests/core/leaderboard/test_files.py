"""The files of a leaderboard in a result folder."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.formats import write_tables

from .rows import row

ROWS = [row(key="1"), row("b", score=0.7, key="2"), row("c", status="failed", score=None, reason="no")]


def test_the_same_rows_in_any_order_give_the_same_bytes_and_a_changed_file_is_made_anew(tmp_path):
    paths = write_tables(ROWS, tmp_path, [{"host": "h", "cpu": "c"}])
    assert {path.suffix for path in paths} == {".md", ".csv", ".json"}
    assert "Host h: c" in (tmp_path / "leaderboard.md").read_text()
    first = [path.read_bytes() for path in paths]
    paths[0].write_text("mine")
    paths[1].unlink()
    assert [path.read_bytes() for path in write_tables(ROWS[::-1], tmp_path, [{"host": "h", "cpu": "c"}])] == first


def test_a_folder_that_refuses_is_a_sentence(tmp_path):
    (tmp_path / "leaderboard.csv").mkdir()
    with pytest.raises(UsageError, match="tables cannot be written"):
        write_tables(ROWS, tmp_path)

"""The files of a leaderboard: written when what decides them has changed, and only then."""

import pytest

from tactbench.core.errors import UsageError
from tactbench.core.leaderboard.files import write_tables

from .rows import row


def stamps(paths):
    return [((path.stat().st_ino, path.stat().st_mtime_ns), path.read_bytes()) for path in paths]


@pytest.fixture
def rows():
    return [row(key="1"), row("b", score=0.7, key="2"), row("c", status="failed", score=None, reason="no")]


def test_files_that_would_be_the_same_are_left_alone(rows, tmp_path):
    paths = write_tables(rows, tmp_path, [{"host": "h"}])
    assert {path.suffix for path in paths} >= {".md", ".csv", ".json"}
    first = stamps(paths)
    assert stamps(write_tables(rows[::-1], tmp_path, [{"host": "h"}])) == first


@pytest.mark.parametrize("change", [{"score": 0.6}, {"remarks": ["new"]}, {"host": "other"}])
def test_any_other_row_writes_them(rows, tmp_path, change):
    before = stamps(write_tables(rows, tmp_path))
    after = stamps(write_tables([rows[0] | change, *rows[1:]], tmp_path))
    assert all(one[0] != other[0] for one, other in zip(before, after, strict=True))


def test_so_does_other_provenance_and_a_file_that_was_changed_or_is_gone(rows, tmp_path):
    paths = write_tables(rows, tmp_path)
    first = stamps(paths)
    write_tables(rows, tmp_path, [{"host": "h", "cpu": "c"}])
    assert "Host h: c" in (tmp_path / "leaderboard.md").read_text()
    write_tables(rows, tmp_path)
    paths[0].write_text("mine")
    paths[1].unlink()
    again = stamps(write_tables(rows, tmp_path))
    assert [content for _, content in again] == [content for _, content in first]


def test_a_damaged_state_is_none(rows, tmp_path):
    first = stamps(write_tables(rows, tmp_path))
    for content in (b"", b"[]", b"{}", b'{"inputs": 1}', b"\xff"):
        (tmp_path / "cache" / "tables.json").write_bytes(content)
        assert [text for _, text in stamps(write_tables(rows, tmp_path))] == [text for _, text in first]


def test_a_folder_that_refuses_is_a_sentence(rows, tmp_path):
    (tmp_path / "leaderboard.csv").mkdir()
    with pytest.raises(UsageError, match="tables cannot be written"):
        write_tables(rows, tmp_path)


def test_values_shared_by_rows_count_as_equal_ones_do(rows, tmp_path):
    shared = {"a": 1}
    alike = [one | {"assumptions": shared} for one in rows]
    apart = [one | {"assumptions": dict(shared)} for one in rows]
    first = stamps(write_tables(alike, tmp_path))
    assert stamps(write_tables(apart, tmp_path)) == first

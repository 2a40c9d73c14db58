"""The result folder: what is kept comes back, what is damaged is told, and no file of the index is needed."""

import json
import math
import re
import shutil
import sqlite3
from contextlib import closing
from dataclasses import fields

import pytest

from tactbench.core.errors import FolderError, FormatError
from tactbench.core.matrix import store as STORE
from tactbench.core.matrix.store import CellFile, Store, read_cell
from tactbench.core.samples import Answers
from tests.conftest import ROOT

from .made import SECTIONS, answers, kept, key, record, row


def file_of(folder, cell):
    return folder / "cells" / f"{key(cell)}.h5"


def test_rows_answers_and_what_the_key_is_made_of_come_back_bit_for_bit(tmp_path):
    with Store(tmp_path).hold() as store:
        name = store.begin({"cpu": "a", "distributions": {"numpy": "2"}})
        given = kept(store, "a/1", n=5000, remarks=["π ≈ 3"], counts={"kept": 3}, score=0.1 + 0.2)
        store.begin({"cpu": "b"})
        kept(store, "b/1", "failed")
    found = Store(tmp_path)
    first, second = found.rows()
    assert first == given == {**row("a/1", "done", 0.1 + 0.2, remarks=["π ≈ 3"], counts={"kept": 3}), "made_by": name}
    assert (second["cell"], second["status"]) == ("b/1", "failed")
    assert found.cell(first).sections == SECTIONS
    assert found.finished(key("a/1")) == first
    wanted, (role, came) = answers(5000), *found.answers(key("a/1")).items()
    assert role == "test"
    for column in fields(Answers):
        one, other = getattr(wanted, column.name), getattr(came, column.name)
        assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes())
    assert found.provenance(name) == {"cpu": "a", "distributions": {"numpy": "2"}}
    assert (found.provenance(second["made_by"]), found.provenance("unknown")) == ({"cpu": "b"}, {})


def test_texts_that_are_no_utf8_are_written_out(tmp_path):
    """Bytes of a file name that is no UTF-8 are lone surrogates in Python's texts."""
    with Store(tmp_path).hold() as store:
        store.begin({"argv": ["\udce9"]})
        given = kept(store, "a/\udce9", "failed", reason="\udcff 𝄞", remarks=["\ud834"], params={"\udce9": 1})
    (found,) = Store(tmp_path).rows()
    assert found == given
    told = {name: found[name] for name in ("cell", "reason", "remarks", "params")}
    assert told == {"cell": r"a/\udce9", "reason": r"\udcff 𝄞", "remarks": [r"\ud834"], "params": {r"\udce9": 1}}


def test_the_latest_of_a_name_counts(tmp_path):
    with Store(tmp_path).hold() as store:
        kept(store, "a", "timeout", key=key(1))
        assert store.finished(key(1)) is None
        kept(store, "b", key=key(1))
        kept(store, "a", "failed", key=key(2))
        assert [one["status"] for one in store.rows()] == ["failed", "done"]
        # Found again by its key: it is the latest now, under the name of today; the one that failed is gone.
        again = {**store.finished(key(1)), "cell": "a"}
        store.reuse(again)
        assert store.rows() == [again]
        assert len(list((tmp_path / "cells").glob("*.h5"))) == 1
        written = (tmp_path / "cells" / f"{key(1)}.h5").stat().st_mtime_ns
        store.reuse(again)
        assert (tmp_path / "cells" / f"{key(1)}.h5").stat().st_mtime_ns == written, "nothing new to say"
        # Two finished ones of one name: the other stays for the version that made it.
        kept(store, "a", key=key(3), score=2.0)
    found = Store(tmp_path)
    assert [one["key"] for one in found.rows()] == [key(3)]
    assert (len(found.answers(key(1))["test"]), found.finished(key(1))["cell"]) == (3, "a")


def test_cells_that_are_named_by_their_number_among_the_repeats_are_read_under_their_seed(tmp_path):
    """Of folders written before replicates were named by their seeds, those that never had a key among them."""
    (tmp_path / "cells").mkdir()
    for old in (row("a/1", repeat=1, seed=3), row("b/1", "failed", repeat=1, seed=3)):
        file_of(tmp_path, old["cell"]).write_bytes(CellFile(old, SECTIONS).content())
    found = Store(tmp_path)
    assert [one["cell"] for one in found.rows()] == ["a/3", "b/3"]
    assert all(found.cell(one).row == one for one in found.rows())


def test_an_answer_from_other_recordings_supersedes_the_older_one_and_that_is_known(tmp_path):
    with Store(tmp_path).hold() as store:
        first = kept(store, "a", key=key(1), digests=["x"])
        kept(store, "a", key=key(2), digests=["x"])  # of another version, from the same recordings
        kept(store, "b", key=key(3), digests=["y"])
        assert store.superseded == []
        kept(store, "a", key=key(4), digests=["y"])
        assert store.superseded == ["a"]
        store.reuse(first)
        assert store.superseded == ["a", "a"]


def test_a_damaged_file_is_told_left_out_and_replaced(tmp_path):
    with Store(tmp_path).hold() as store:
        kept(store, "a")
        kept(store, "b")
    file = file_of(tmp_path, "a")
    file.write_bytes(file.read_bytes()[:-1])
    found = Store(tmp_path)
    assert [one["cell"] for one in found.rows()] == ["b"]
    assert (found.finished(key("a")), found.answers(key("a"))) == (None, {})
    assert file.name in " ".join(found.troubles)
    with Store(tmp_path).hold() as again:
        kept(again, "a", score=2.0)
    assert Store(tmp_path).finished(key("a"))["score"] == 2.0
    assert not Store(tmp_path).troubles


def test_a_changed_byte_is_seen(tmp_path):
    with Store(tmp_path).hold() as store:
        kept(store, "a")
    path = file_of(tmp_path, "a")
    content = path.read_bytes()
    for place in range(0, len(content), 97):
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
        with pytest.raises(FormatError):
            read_cell(path)


def _older(index, folder):
    index.unlink()
    shutil.copy(folder / "older.sqlite", index)


def _in_the_way(index, folder):
    index.unlink()
    index.mkdir()


def _of_another_version(index, _):
    with closing(sqlite3.connect(index)) as database:
        database.executescript("DROP TABLE cells; CREATE TABLE cells (file, cell, key, seed); PRAGMA user_version = 2")


INDEXES = {
    "lost": lambda index, _: index.unlink(),
    "damaged": lambda index, _: index.write_bytes(b"no database" * 1000),
    "damaged in the middle": lambda index, _: index.write_bytes(index.read_bytes()[:4096] + b"\xff" * 4096 * 20),
    "older than the files": _older,
    "of another version": _of_another_version,
    "cannot be written": _in_the_way,
}


@pytest.mark.parametrize("what", INDEXES)
def test_without_a_usable_index_the_rows_are_the_same(tmp_path, what):
    with Store(tmp_path).hold() as store:
        store.begin({"cpu": "a"})
        kept(store, "a")
        kept(store, "b", "failed", log="the end")
        kept(store, "c", "timeout", key=key("c"))
        shutil.copy(tmp_path / "results.sqlite", tmp_path / "older.sqlite")
        kept(store, "c", key=key("other"))
        before = store.rows()
    INDEXES[what](tmp_path / "results.sqlite", tmp_path)
    found = Store(tmp_path)
    assert json.dumps(found.rows()) == json.dumps(before), "tables are the same to the byte"
    assert found.troubles == []
    assert found.finished(key("a")) == before[0]
    assert found.provenance(before[0]["made_by"]) == {"cpu": "a"}
    if (index := tmp_path / "results.sqlite").is_dir():
        return
    assert Store(tmp_path).rows() == before
    with closing(sqlite3.connect(index)) as database:
        assert database.execute("SELECT count(*) FROM cells").fetchone() == (3,), "it was made anew"


def test_what_a_recording_says_is_read_again_when_its_file_has_changed(tmp_path):
    path = record(tmp_path / "recordings" / "made" / "scene.h5")

    def rewritten(**change):
        path.unlink()
        record(path, **change)
        return store.about(path)

    with Store(tmp_path).hold() as store:
        first = store.about(path)
        assert (first["sensor"], first["scene"]) == ("made", None)
        assert dict(Store(tmp_path).about(path)) == dict(first)
        assert rewritten(seconds=9.0) == first, "how long it took is no part of its content"
        assert rewritten(reading=2.0)["digest"] != first["digest"]
    assert store.beside(path) == "recordings/made/scene.h5"
    assert store.recordings({"recordings": ["recordings/made/scene.h5", "gone.h5"]}) == [
        ("recordings/made/scene.h5", path), ("gone.h5", None),
    ]  # fmt: skip


def test_a_second_run_is_refused_reading_is_not_and_what_was_half_written_goes(tmp_path):
    left = tmp_path / "cells" / f".{key('b')}.h5.1.partial"
    left.parent.mkdir()
    left.write_bytes(b"half")
    with Store(tmp_path).hold() as store:
        assert not left.exists()
        kept(store, "a")
        with pytest.raises(FolderError, match=r"Another run"), Store(tmp_path).hold():
            pass
        assert [one["cell"] for one in Store(tmp_path).rows()] == ["a"]
    with pytest.raises(FolderError, match="written"), Store(file_of(tmp_path, "a")).hold():
        pass


def test_the_queries_of_the_page_run(tmp_path):
    page = (ROOT / "docs" / "results.md").read_text()
    with Store(tmp_path / "tactbench-results").hold() as store:
        for seed in (10, 2):
            kept(store, f"a/{seed}", seed=seed, score=float(seed))
        kept(store, "b/1", "failed")
        assert [one["cell"] for one in store.rows()] == ["a/2", "a/10", "b/1"], "replicates as numbers"
    found = []
    with closing(sqlite3.connect(tmp_path / "tactbench-results" / "results.sqlite")) as database:
        for query in re.findall(r"```sql\n(.*?)```", page, re.DOTALL) + re.findall(r'read_sql\(\s*"(.*?)"', page):
            found.append(database.execute(query).fetchall())
    means, stopped, everything = found
    assert means == [("icub", "force", "mean", 6.0, 2)]
    assert stopped == [("b/1", "failed", "untested")]
    assert {line[0] for line in everything} == {"a/10", "a/2", "b/1"}
    assert {json.loads(line[-1])["cell"] for line in everything} == {"a/10", "a/2", "b/1"}


def test_no_plain_data_and_what_is_read_back_otherwise_leave_no_file(tmp_path, monkeypatch):
    monkeypatch.setattr(STORE, "replace_file", lambda path, content: path.write_bytes(content[:-1]))
    with Store(tmp_path).hold() as store:
        for error, chosen in ((ValueError, {"alpha": math.nan}), (FolderError, {})):
            with pytest.raises(error, match=r"JSON|differs from what was written"):
                kept(store, "a", chosen=chosen)
        assert (store.finished(key("a")), store.rows(), list(tmp_path.glob("cells/*"))) == (None, [], [])

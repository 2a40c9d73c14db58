"""The result folder: what is kept comes back, the latest of each name; what is not whole is not taken for whole."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from tactbench.core.matrix.store import NotPlainError, Store

from .made import PLAN, answers, done, ended, kept, key

COLUMNS = ("y_true", "y_pred", "recording", "row", "fold", "time_s", "force_n")


def shard(folder, cell):
    return folder / "cells" / f"{key(cell)}.h5"


@pytest.mark.parametrize("rows", [0, 20, 5000])
def test_answers_come_back_by_role_bit_for_bit(tmp_path, rows):
    given = {"train": answers(rows, 1), "test": answers(20, 2)}
    Store(tmp_path).keep(key("a"), done("a"), given)
    found = Store(tmp_path).answers(key("a"))
    assert set(found) == {"train", "test"}
    for role, one in given.items():
        for name in COLUMNS:
            assert np.array_equal(getattr(found[role], name), getattr(one, name), equal_nan=True), (role, name)
            assert getattr(found[role], name).dtype == getattr(one, name).dtype


def test_a_row_is_returned_as_it_comes_back(tmp_path):
    store = Store(tmp_path)
    kept_now = store.keep(key("a"), {**done("a"), "classes": (1, 2), "counts": {"b": 1, "a": 2}}, {"test": answers(3)})
    noted_now = store.note({**ended("b"), "classes": ("one",)})
    assert [kept_now, noted_now] == Store(tmp_path).rows()
    assert (kept_now["classes"], list(kept_now["counts"])) == ([1, 2], ["a", "b"])
    kept_now["baseline"] = 1.0  # whoever got it may write in it
    assert "baseline" not in store.rows()[0]


@pytest.mark.parametrize(
    "lie", [float("nan"), float("inf"), object(), {1: 2, "a": 3}, (lambda n: n.append(n) or n)([])]
)
def test_of_a_row_that_is_no_plain_data_nothing_is_written(tmp_path, lie):
    store = Store(tmp_path)
    kept(store, "a")
    before = (tmp_path / "index.jsonl").read_bytes()
    with pytest.raises(NotPlainError):
        kept(store, "b", chosen=lie)
    assert (tmp_path / "index.jsonl").read_bytes() == before
    assert [row["cell"] for row in Store(tmp_path).rows()] == ["a"]
    assert sorted(path.name for path in (tmp_path / "cells").iterdir()) == [f"{key('a')}.h5"]


def test_the_latest_of_each_name_is_listed_however_it_ended(tmp_path):
    store = Store(tmp_path)
    kept(store, "a", 1.0, key=key(1))
    kept(store, "b", 2.0)
    store.note(ended("c", "skipped"))
    kept(store, "a", 3.0, key=key(2))
    store.note(ended("b", "crashed", signal=6))
    for one in (store, Store(tmp_path)):
        told = [(row["cell"], row["status"], row.get("score")) for row in one.rows()]
        assert told == [("a", "done", 3.0), ("b", "crashed", None), ("c", "skipped", None)]


def test_a_finished_cell_found_again_is_the_last_word_on_its_name(tmp_path):
    kept(Store(tmp_path), "a", 1.0, key=key(1))
    Store(tmp_path).note(ended("a"))
    again = Store(tmp_path)
    row = again.finished(key(1))
    again.reuse(row)
    assert [one["status"] for one in Store(tmp_path).rows()] == ["done"]
    before = (tmp_path / "index.jsonl").read_bytes()
    again.reuse(row)
    Store(tmp_path).reuse(row)
    assert (tmp_path / "index.jsonl").read_bytes() == before  # said once is enough


def test_a_finished_cell_may_go_by_another_name(tmp_path):
    kept(Store(tmp_path), "a/1", 1.0, key=key(1), repeat=1, repeats=1)
    store = Store(tmp_path)
    store.reuse({**store.finished(key(1)), "cell": "a/2", "repeat": 2, "repeats": 2})
    rows = {row["cell"]: row for row in Store(tmp_path).rows()}
    assert rows["a/2"] == {**rows["a/1"], "cell": "a/2", "repeat": 2, "repeats": 2}


def test_a_cell_that_ends_the_same_way_again_adds_nothing(tmp_path):
    Store(tmp_path).note(ended("a", plan=PLAN))
    before = (tmp_path / "index.jsonl").read_bytes()
    Store(tmp_path).note(ended("a", plan=PLAN))
    assert (tmp_path / "index.jsonl").read_bytes() == before


@pytest.mark.parametrize("damage", ["missing", "cut", "empty", "longer", "link"])
def test_a_shard_that_is_not_whole_is_no_finished_cell(tmp_path, damage):
    store = Store(tmp_path)
    kept(store, "a")
    path = shard(tmp_path, "a")
    whole = path.read_bytes()
    path.unlink()
    if damage == "link":
        (tmp_path / "elsewhere.h5").write_bytes(whole)
        path.symlink_to(tmp_path / "elsewhere.h5")
    elif damage != "missing":
        path.write_bytes({"cut": whole[:-1], "empty": b"", "longer": whole + b"\0"}[damage])
    for one in (store, Store(tmp_path)):
        assert one.finished(key("a")) is None
        assert one.answers(key("a")) == {}
        assert one.rows() == []
        assert "its shard is missing, cut or not of this row" in " ".join(one.troubles)
    kept(store, "a", 2.0)
    assert Store(tmp_path).finished(key("a"))["score"] == 2.0


def test_one_changed_byte_of_a_shard_is_seen_when_it_is_opened(tmp_path):
    kept(Store(tmp_path), "a")
    whole = shard(tmp_path, "a").read_bytes()
    for place in np.linspace(0, len(whole) - 1, 40).astype(int):
        shard(tmp_path, "a").write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        store = Store(tmp_path)
        assert store.answers(key("a")) == {}
        assert "is not the one that was written" in store.troubles[0]


def test_a_lost_ledger_is_made_of_the_shards(tmp_path):
    store = Store(tmp_path)
    kept(store, "a", 1.5, plan=PLAN)
    kept(store, "b", 2.5, plan=PLAN)
    before = store.rows()
    (tmp_path / "index.jsonl").unlink()
    found = Store(tmp_path)
    assert sorted(found.rows(), key=lambda row: row["cell"]) == before
    assert len(found.answers(key("b"))["test"]) == 3
    for row in before:
        found.reuse(found.finished(row["key"]))
    assert Store(tmp_path).rows() == before


def test_a_damaged_shard_without_a_line_is_told_and_not_taken_in(tmp_path):
    kept(Store(tmp_path), "a")
    (tmp_path / "index.jsonl").unlink()
    whole = shard(tmp_path, "a").read_bytes()
    place = whole.index(b'"score": 1.0')
    shard(tmp_path, "a").write_bytes(whole[: place + 9] + b"9.0" + whole[place + 12 :])
    store = Store(tmp_path)
    assert store.rows() == []
    assert store.finished(key("a")) is None
    assert "is damaged" in store.troubles[0] or "does not hold what was written" in store.troubles[0]


def test_a_shard_under_another_cells_key_is_not_taken_in(tmp_path):
    kept(Store(tmp_path), "a")
    (tmp_path / "index.jsonl").unlink()
    shard(tmp_path, "a").rename(shard(tmp_path, "b"))
    assert Store(tmp_path).rows() == []


def test_only_keys_become_names_of_files(tmp_path):
    store = Store(tmp_path)
    for bad in ("../../x", "k1", "", key(1).upper(), key(1) + "\n"):
        with pytest.raises(ValueError, match="32 hexadecimal digits"):
            store.keep(bad, done("a"), {})
        assert store.finished(bad) is None
        assert store.answers(bad) == {}
    assert not (tmp_path / "cells").exists()


def test_equal_provenances_have_one_file_and_come_back(tmp_path):
    with Store(tmp_path).hold() as store:
        about = {"cpu": "a", "distributions": {"numpy": "2"}}
        name = store.begin(about)
        assert store.begin({"distributions": {"numpy": "2"}, "cpu": "a"}) == name
        assert store.begin({"cpu": "b"}) != name
        store.begin(about)
        kept(store, "a", made_by=name)
    assert Store(tmp_path).provenance(name) == about
    assert b'"cpu": "a"' in shard(tmp_path, "a").read_bytes()
    (tmp_path / "provenance" / f"{name}.json").write_text('{"cpu": "forged"}')
    assert Store(tmp_path).provenance(name) == {}
    assert Store(tmp_path).provenance("../index") == {}


def test_what_rows_share_is_written_once_and_is_one_object(tmp_path):
    store = Store(tmp_path)
    for number in range(20):
        kept(store, f"c{number}", plan=PLAN, replicates={"unit": "session", "names": ["s" * 9] * 30, "sums": [[1.0]]})
    rows = Store(tmp_path).rows()
    assert all(row["plan"] is rows[0]["plan"] for row in rows)
    assert rows[0]["plan"] == PLAN
    assert rows[7]["replicates"] == {"unit": "session", "names": ["s" * 9] * 30, "sums": [[1.0]]}
    assert (tmp_path / "index.jsonl").read_text().count("called for by a test") == len(PLAN)


def test_file_times_decide_nothing(tmp_path):
    store = Store(tmp_path)
    kept(store, "a", 1.0, key=key(1))
    kept(store, "a", 2.0, key=key(2))
    store.note(ended("b"))
    before = store.rows()
    paths = [path for path in tmp_path.rglob("*") if path.is_file()]
    for turn in (1, -1):
        for place, path in enumerate(paths[::turn]):
            os.utime(path, (4e9 - 1e8 * place, 1e8 * place))
        found = Store(tmp_path)
        assert found.rows() == before
        assert found.finished(key(1))["score"] == 1.0
        with found.hold():
            kept(found, "c")
        shard(tmp_path, "c").unlink()


def test_a_found_cell_imports_neither_hdf5_nor_numpy(tmp_path):
    kept(Store(tmp_path), "a", plan=PLAN)
    Store(tmp_path).note(ended("b"))
    code = (
        "import sys\nfrom pathlib import Path\nfrom tactbench.core.matrix.store import Store\n"
        "store = Store(Path(sys.argv[1]))\n"
        "with store.hold():\n"
        "    store.reuse(store.finished(sys.argv[2]))\n"
        "    store.note({'cell': 'b', 'status': 'failed', 'reason': 'another'})\n"
        "assert len(store.rows()) == 2\n"
        "assert not {'h5py', 'numpy'} & set(sys.modules), sorted({'h5py', 'numpy'} & set(sys.modules))\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path), key("a")], check=True)


def test_reading_a_folder_makes_nothing(tmp_path):
    store = Store(tmp_path / "none")
    assert store.rows() == []
    assert store.finished(key(1)) is None
    assert not (tmp_path / "none").exists()


def test_a_long_log_is_kept_from_its_end(tmp_path):
    Store(tmp_path).note(ended("a", log="x" * 100_000 + "the end"))
    (row,) = Store(tmp_path).rows()
    assert len(row["log"]) < 70_000
    assert row["log"].endswith("the end")
    assert json.dumps(row)


def test_what_a_process_left_that_nobody_has_reaped_is_removed_and_that_of_a_living_one_is_not(tmp_path):
    cells = tmp_path / "cells"
    cells.mkdir()
    with subprocess.Popen([sys.executable, "-c", "pass"]) as over:
        os.waitid(os.P_PID, over.pid, os.WEXITED | os.WNOWAIT)
        for process in (over.pid, os.getpid()):
            (cells / f".{key('a')}.h5.{process}.partial").write_bytes(b"half")
        with Store(tmp_path).hold():
            assert [path.name for path in cells.iterdir()] == [f".{key('a')}.h5.{os.getpid()}.partial"]

"""The ledger: whole lines only, whatever was cut short; limits on what a stranger's may ask for."""

import json
import os
import resource
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.errors import FolderError
from tactbench.core.matrix.store import Store, limits
from tactbench.core.matrix.store.ledger import Entry, read_ledger, whole_text
from tactbench.core.matrix.store.sharing import canonical, joined, parted

from .made import PLAN, ended, kept, key

values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats() | st.text(max_size=40),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=5), inner, max_size=5),
    max_leaves=20,
)
rows = st.fixed_dictionaries(
    {"cell": st.text(min_size=1, max_size=9)},
    optional={
        "plan": st.lists(st.dictionaries(st.text(), st.text(max_size=80), max_size=3), max_size=4),
        "assumptions": st.dictionaries(st.text(max_size=9), values, max_size=4),
        "replicates": st.fixed_dictionaries({"names": st.lists(st.text(max_size=30), max_size=9), "sums": values}),
        "params": st.dictionaries(st.text(max_size=9), values, max_size=3),
        "something": values,
    },
)


@given(st.lists(rows, max_size=5))
def test_what_was_written_is_read_bit_for_bit_whatever_is_shared(given_rows):
    texts = {}
    for row in given_rows:
        slim, references, fresh = parted(row)
        texts |= fresh
        back = joined(json.loads(canonical(slim)), references, {name: json.loads(text) for name, text in texts.items()})
        assert canonical(back) == canonical(row)


def test_a_line_cut_short_anywhere_costs_that_line_only(tmp_path):
    store = Store(tmp_path)
    store.note(ended("a", plan=PLAN))
    before = (tmp_path / "index.jsonl").read_bytes()
    store.note(ended("b", remarks=["a remark " * 20]))
    whole = (tmp_path / "index.jsonl").read_bytes()
    for end in range(len(before), len(whole), 7):
        (tmp_path / "index.jsonl").write_bytes(whole[:end])
        again = Store(tmp_path)
        assert {row["cell"] for row in again.rows()} == {"a"}
        again.note(ended("c", plan=PLAN))
        found = Store(tmp_path)
        assert [row["cell"] for row in found.rows()] == ["a", "c"]
        assert found.troubles == ()  # the torn line was cut away, nothing was glued to it
        assert found.rows()[1]["plan"] == PLAN


def test_a_canonical_text_is_read_as_it_was(tmp_path):
    entries = [Entry({"key": "", **ended(name, plan=PLAN)}) for name in "abc"]
    (tmp_path / "index.jsonl").write_text(whole_text(entries))
    assert read_ledger(tmp_path).entries == entries


GOOD = {"cell": "a", "status": "failed"}
DONE = {"cell": "a", "status": "done", "key": key("a")}


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ({"row": {**GOOD, "score": "1.0"}}, "its score: Input should be a valid number"),
        ({"row": {**GOOD, "score": True}}, "its score: Input should be a valid number"),
        ({"row": {**GOOD, "scores": {"mae": "<b>"}}}, "its scores.mae: Input should be a valid number"),
        ({"row": {**GOOD, "recordings": [1]}}, "its recordings.0: Input should be a valid string"),
        ({"row": {**GOOD, "confusion": [1]}}, "its confusion.0: Input should be a valid list"),
        ({"row": {**GOOD, "status": "perfect"}}, "its status: Input should be 'done', 'failed'"),
        ({"row": {"status": "failed"}}, "its cell: Field required"),
        ({"row": {**GOOD, "cell": ["a"]}}, "its cell: Input should be a valid string"),
        ({"row": DONE}, "it names no shard"),
        ({"row": DONE, "shard": ["0" * 64, -1]}, "it names no shard"),
        ({"row": {**DONE, "key": "../../x"}, "shard": ["0" * 64, 9]}, "it names no shard"),
        ({"row": {**GOOD, "key": "../../x"}}, "its key is none"),
        ({"row": GOOD, "refs": {"plan": "0" * 32}}, "refer to what is not there"),
        ({"row": GOOD, "refs": ["plan"]}, "refer to what is not there"),
        ({"row": GOOD, "refs": {"cell/x": "0" * 32}}, "refer to what is not there"),
        ({"shared": "0" * 32, "value": [1]}, "could not be read"),
        ({"row": {**GOOD, "log": "\ud800"}}, "could not be read"),
        ({"row": {**GOOD, "params": json.loads("[" * 100 + "]" * 100)}}, "could not be read"),
        ("[" * 100_000, "could not be read"),
        (b"\xff\xfe", "could not be read"),
        ("9" * 5000, "could not be read"),
        ("null", "could not be read"),
    ],
)  # fmt: skip
def test_a_line_that_makes_no_sense_is_left_out_and_told(tmp_path, line, says):
    store = Store(tmp_path)
    store.note(ended("before"))
    content = line if isinstance(line, bytes) else (line if isinstance(line, str) else json.dumps(line)).encode()
    with (tmp_path / "index.jsonl").open("ab") as ledger:
        ledger.write(content + b"\n")
    found = Store(tmp_path)
    assert [row["cell"] for row in found.rows()] == ["before"]
    assert says in " ".join(found.troubles)
    found.note(ended("after"))
    assert [row["cell"] for row in Store(tmp_path).rows()] == ["before", "after"]


@pytest.mark.parametrize("empty", ["[]", "{}", '"[]"', "[ ]", "1"])
def test_lines_nest_as_deeply_as_is_allowed_and_no_deeper(tmp_path, empty):
    store = Store(tmp_path)
    inside = 0 if empty in ('"[]"', "1") else 1
    for name, deep in (("held", limits.DEPTH - 2 - inside), ("over", limits.DEPTH - 1 - inside)):
        store.note(ended(name))
        row = json.dumps({"row": {**GOOD, "cell": name, "simulation": 0}})
        nested = '{"a": ' * deep + empty + "}" * deep
        with (tmp_path / "index.jsonl").open("a") as ledger:
            ledger.write(row.replace('"simulation": 0', f'"simulation": {nested}') + "\n")
    found = {row["cell"]: "simulation" in row for row in Store(tmp_path).rows()}
    assert found == {"held": True, "over": False}


@pytest.mark.parametrize(
    ("limit", "value", "says"),
    [("LINE_BYTES", 300, "could not be read"), ("ENTRIES", 1, "could not be read"),
     ("SHARED_CHARACTERS", 900, "would fill the memory")],
)  # fmt: skip
def test_what_is_more_than_a_limit_is_left_out_and_told(tmp_path, monkeypatch, limit, value, says):
    store = Store(tmp_path)
    store.note(ended("a"))
    store.note(ended("b", log="x" * 1000))
    monkeypatch.setattr(limits, limit, value)
    found = Store(tmp_path)
    assert [row["cell"] for row in found.rows()] == ["a"]
    assert says in found.troubles[0]


def test_a_ledger_beyond_all_measure_is_refused(tmp_path, monkeypatch):
    Store(tmp_path).note(ended("a"))
    monkeypatch.setattr(limits, "LEDGER_BYTES", 10)
    with pytest.raises(FolderError, match="larger than"):
        Store(tmp_path).rows()


def test_rows_that_share_a_value_take_its_memory_once(tmp_path):
    """A stranger's ledger of a thousand lines that share a megabyte is no gigabyte."""
    big = ["x" * 2**20]
    store = Store(tmp_path)
    for number in range(50):
        store.note(ended(f"c{number}", remarks=big))
    assert (tmp_path / "index.jsonl").stat().st_size < 2 * 2**20
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert len(Store(tmp_path).rows()) == 50
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 30 * 1024


def test_a_failed_write_leaves_the_ledger_as_it_was(tmp_path):
    """A real limit on the size of files: the second line meets it in the middle."""
    code = (
        "import os, resource, sys\nfrom pathlib import Path\nfrom tactbench.core.errors import FolderError\n"
        "from tactbench.core.matrix.store import Store\n"
        "store = Store(Path(sys.argv[1]))\n"
        "store.note({'cell': 'a', 'status': 'failed'})\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (200, 200))\n"
        "try:\n    store.note({'cell': 'b', 'status': 'failed', 'log': 'x' * 1000})\n"
        "except FolderError as error:\n    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True, capture_output=True, text=True)
    assert "larger than this process may write" in done.stdout
    assert "the same command goes on" in done.stdout
    assert (tmp_path / "index.jsonl").read_bytes().count(b"\n") == 1
    assert (tmp_path / "index.jsonl").read_bytes().endswith(b"\n")
    assert [row["cell"] for row in Store(tmp_path).rows()] == ["a"]


def test_keeping_after_a_torn_line_keeps_its_shared_values(tmp_path):
    store = Store(tmp_path)
    kept(store, "a", plan=PLAN)
    size = (tmp_path / "index.jsonl").stat().st_size
    os.truncate(tmp_path / "index.jsonl", size - 3)
    again = Store(tmp_path)
    kept(again, "b", plan=PLAN)
    assert {row["cell"] for row in Store(tmp_path).rows()} == {"a", "b"}
    assert all(row["plan"] == PLAN for row in Store(tmp_path).rows())

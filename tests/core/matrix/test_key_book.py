"""The book of keys: what went in comes out, and whatever happens to it, nothing but an explanation is lost."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.matrix.key_book import Entry, KeyBook, recording_names
from tactbench.core.matrix.keys import Fixed
from tactbench.core.matrix.why import differences

FIXED = Fixed("f", {"task": {"metric": "rmse"}, "source of acme": {"a.py": "1"}, "versions": {"numpy": "2.0"}})
DATA = {"press": {"digest": "d1", "path": "recordings/press.h5"}}


def entry(name="cell", key="0" * 32, seed=1, fixed=FIXED, data=DATA):
    return Entry(name, key, {"seed": seed}, fixed, data)


def sections(seed=1):
    return {**FIXED.sections, "configuration": {"seed": seed}, "data": DATA}


def test_what_was_written_comes_back_by_name_and_by_key(tmp_path):
    KeyBook(tmp_path).write([entry(key="1" * 32), entry(key="2" * 32, seed=2)])
    book = KeyBook(tmp_path)
    assert book.sections("cell") == sections(2)
    assert book.sections("cell", "1" * 32) == sections(1)
    assert book.sections("another") is None


def test_the_same_key_again_adds_nothing(tmp_path):
    for _ in range(3):
        KeyBook(tmp_path).write([entry()])
    assert len((tmp_path / "keys.jsonl").read_text().splitlines()) == 1


def test_a_line_cut_short_costs_that_line_only(tmp_path):
    KeyBook(tmp_path).write([entry("one", "1" * 32), entry("two", "2" * 32)])
    path = tmp_path / "keys.jsonl"
    path.write_text(path.read_text()[:-20])
    KeyBook(tmp_path).write([entry("three", "3" * 32)])
    book = KeyBook(tmp_path)
    assert (book.sections("one"), book.sections("two"), book.sections("three")) == (sections(), None, sections())


def test_a_section_that_is_lost_or_leads_elsewhere_is_empty(tmp_path):
    book = tmp_path / "book"
    KeyBook(book).write([entry()])
    (tmp_path / "secret.json").write_text('{"task": {"secret": 1}}')
    line = json.loads((book / "keys.jsonl").read_text())
    for reference in ("../secret", str(tmp_path / "secret"), "f" * 32, None, 3):
        (book / "keys.jsonl").write_text(json.dumps({**line, "fixed": reference, "data": reference}) + "\n")
        assert "secret" not in json.dumps(KeyBook(book).sections("cell"))


def test_books_taken_together_hold_the_wanted_keys_of_all_in_whatever_order(tmp_path):
    KeyBook(tmp_path / "a").write([entry("one", "1" * 32), entry("two", "2" * 32), entry("old", "0" * 32)])
    KeyBook(tmp_path / "b").write([entry("two", "2" * 32), entry("three", "3" * 32, fixed=Fixed("g", {"task": {}}))])
    KeyBook(tmp_path / "c").write([entry("one", "1" * 32)])
    for part in (tmp_path / "c").glob("?" * 32 + ".json"):
        part.write_text('{"task": {"altered": 1}}')  # not what its name says: as if it were lost
    found = []
    for order in ("abc", "cba", "bcab"):
        KeyBook(tmp_path / order).take((KeyBook(tmp_path / name), {"1" * 32, "2" * 32, "3" * 32}) for name in order)
        found.append({path.name: path.read_bytes() for path in (tmp_path / order).iterdir()})
    assert found[0] == found[1] == found[2]
    book = KeyBook(tmp_path / "abc")
    assert book.sections("one") == book.sections("two") == sections()
    assert book.sections("three") == {"task": {}, "configuration": {"seed": 1}, "data": DATA}
    assert book.sections("old") is None


def test_a_folder_that_cannot_be_written_costs_nothing(tmp_path):
    (tmp_path / "file").write_text("")
    KeyBook(tmp_path / "file" / "keys").write([entry()])


@given(
    st.dictionaries(
        st.text("ab."),
        st.none() | st.integers() | st.lists(st.integers() | st.dictionaries(st.just("k"), st.integers())),
    )
)
def test_nothing_differs_from_itself(facts):
    assert differences({"task": facts}, json.loads(json.dumps({"task": facts}))) == []


@pytest.mark.parametrize(
    ("before", "now", "said"),
    [
        ({"configuration": {"seed": 1}}, {"configuration": {"seed": 2}}, ["seed 1 -> 2"]),
        ({"configuration": {"split": None}}, {"configuration": {"split": "unit"}}, ["split None -> unit"]),
        ({"versions": {"scipy": "1.8.0"}}, {"versions": {"scipy": "1.9.1"}}, ["scipy 1.8.0 -> 1.9.1"]),
        ({"task": {"grid": [1, 2]}}, {"task": {"grid": [1, 3]}}, ["task: grid [1, 2] -> [1, 3]"]),
        ({"task": {"a": [{"b": 1}]}}, {"task": {"a": [{"b": 2}]}}, ["task: a[0].b 1 -> 2"]),
        ({"task": {"a": 1}}, {"task": {}}, ["task: a 1 -> nothing"]),
        ({"task": {"a": {}}}, {"task": {"a": {"b": 1}}}, ["task: a.b nothing -> 1"]),
        ({"source of acme": {"a.py": "1", "b.py": "1"}}, {"source of acme": {"a.py": "2", "c.py": "1"}},
         ["acme/a.py changed", "acme/b.py is gone", "acme/c.py is new"]),
        ({}, {"source of acme": {"a.py": "1"}}, ["the source of acme counts now"]),
        ({"data": DATA}, {"data": {"press": {"digest": "d2", "path": "recordings/press.h5"}}},
         ["recording press has other bytes"]),
        ({"data": DATA}, {"data": {"press": {"digest": "d1", "path": "moved/press.h5"}}}, []),
        ({"data": DATA}, {"data": {}}, ["recording press is gone"]),
    ],
)  # fmt: skip
def test_differences_are_said_in_words(before, now, said):
    assert differences(before, now) == said


def test_names_of_recordings_outlive_their_keys_and_are_unique():
    folder = Path("/out/recordings/ideal")
    first = [
        folder / "flat-test-0123456789ab.h5",
        folder / "flat-train-0123456789ab.h5",
        folder / "flat-test-aaaaaaaaaaaa.h5",
    ]
    assert recording_names(first) == ["flat-test", "flat-train", "flat-test (2)"]
    shelf = [Path("/shelf/one/press.h5"), Path("/shelf/two/press.h5")]
    assert recording_names(shelf) == ["one/press", "two/press"]
    assert recording_names([]) == []

"""Places, their intervals, and what is remembered of them."""

import json
import subprocess
import sys

import numpy as np
import pytest

from tactbench.core.leaderboard import memo
from tactbench.core.leaderboard.placing import Placing, places
from tactbench.core.leaderboard.sheet import Sheet
from tactbench.core.leaderboard.table import build_table
from tactbench.core.statistics.ranking import ranks

from .rows import resampled, row


@pytest.fixture(autouse=True)
def _forgetful(monkeypatch):
    monkeypatch.setattr(memo, "_known", {})
    monkeypatch.setattr(memo, "_added", set())


@pytest.fixture
def rows():
    rng = np.random.default_rng(7)
    return [resampled("a", 0.0, rng), resampled("b", 0.02, rng), resampled("c", 2.0, rng)]


def test_without_replicates_places_are_by_score_and_the_table_says_so():
    rows = [row("a"), row("b"), row("c", score=0.9)]
    found, why = places(Sheet(rows))
    assert list(found.values()) == [
        Placing(1, None, None, True),
        Placing(1, None, None, True),
        Placing(3, None, None, False),
    ]
    assert why
    table = build_table(rows)
    assert [line.cells[5] for line in table.blocks[0].lines] == ["–", "–", "–"]
    assert any("by score alone" in note for note in table.notes)


def test_with_replicates_ties_share_a_place_and_every_place_has_an_interval(rows):
    table = build_table(rows)
    assert not any("by score alone" in note for note in table.notes)
    lines = table.blocks[0].lines
    told = {one: (rank.place, rank.low, rank.high, rank.tied) for one, rank in ranks(rows).items()}
    for line in lines:
        place, low, high, tied = told[line.cell]
        assert line.cells[0] == f"{place}{'=' if tied else ''}"
        assert line.cells[5] == (f"{low}–{high}" if low != high else str(low))
    assert [line.cells[0] for line in lines] == ["1=", "1=", "3"]
    assert any("A place with =" in note for note in table.notes)


def test_replicates_that_are_no_replicates_are_no_traceback(rows):
    for nonsense in ({"sums": "x"}, {"unit": 3, "names": None, "strata": "a", "sums": [[1], "b"]}, {"sums": [[]]}):
        lines = build_table([*rows[1:], rows[0] | {"replicates": nonsense}]).blocks[0].lines
        assert len(lines) == 3


def test_ranks_are_found_again_by_what_decides_them(rows, tmp_path):
    (tmp_path / "cache").mkdir()
    first = build_table(rows).blocks
    memo.save(tmp_path)
    memo._known.clear()
    memo.load(tmp_path)
    known = dict(memo._known)
    assert len(known) == 1
    assert build_table(rows).blocks == first
    assert build_table(rows[::-1]).blocks == first
    assert memo._known == known
    build_table([rows[0] | {"score": rows[0]["score"] + 1e-9}, *rows[1:]])
    assert len(memo._known) == 2


@pytest.mark.parametrize(
    "forge",
    [
        lambda entry: "no list",
        lambda entry: [[*one[:1], 0, *one[2:]] for one in entry],
        lambda entry: [[*one[:3], 99, one[4]] for one in entry],
        lambda entry: [[*one[:4], "yes"] for one in entry],
        lambda entry: [["another", *one[1:]] for one in entry],
        lambda entry: entry[:1],
        lambda entry: [[one[0], 3 - place, 1, 3, False] for place, one in enumerate(entry)],
        lambda entry: [[one[0], 1.5, 1, 3, False] for one in entry],
    ],
)
def test_a_memo_that_lies_is_not_believed(rows, tmp_path, forge):
    (tmp_path / "cache").mkdir()
    first = build_table(rows).blocks
    memo.save(tmp_path)
    path = tmp_path / memo.FILE
    entries = json.loads(path.read_text())
    forged = {digest: forge(entry) for digest, entry in entries.items()}
    assert forged != entries
    path.write_text(json.dumps(forged))
    memo._known.clear()
    memo.load(tmp_path)
    assert build_table(rows).blocks == first


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b"{", b"[" * 100_000])
def test_a_damaged_memo_is_no_memo(tmp_path, content):
    (tmp_path / "cache").mkdir()
    (tmp_path / memo.FILE).write_bytes(content)
    memo.load(tmp_path)
    assert memo._known == {}


def test_ranks_that_are_remembered_need_no_numerics(rows, tmp_path):
    (tmp_path / "cache").mkdir()
    build_table(rows)
    memo.save(tmp_path)
    (tmp_path / "rows.json").write_text(json.dumps(rows))
    code = (
        "import json, pathlib, sys\n"
        "from tactbench.core.leaderboard import memo\n"
        "from tactbench.core.leaderboard.table import build_table\n"
        "memo.load(pathlib.Path('.'))\n"
        "print(build_table(json.loads(pathlib.Path('rows.json').read_text())).blocks[0].lines[2].cells[0])\n"
        "print([name for name in ('numpy', 'scipy', 'h5py', 'rich') if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["3", "[]"]

"""What a table says of errors of force: the floor once, the error beyond it, which protocol tares."""

import pytest

from tactbench.core.leaderboard.columns import COLUMNS, IF_KNOWN
from tactbench.core.leaderboard.records import records
from tactbench.core.leaderboard.table import build_table
from tests.core.leaderboard.rendering import to_markdown

from .rows import row

KNOWN = {
    "reference_floor": 0.6875, "score_beyond_floor": 0.1234, "beyond_floor_ci_low": 0.0, "beyond_floor_ci_high": 0.2,
    "true_score": 0.0512, "true_ci_low": 0.04, "true_ci_high": 0.06, "tare_s": 7.2,
}  # fmt: skip


def told(table, text):
    return [note for note in table.notes if text in note]


def test_the_floor_is_said_once_and_the_error_beyond_it_stands_beside_the_score():
    rows = [row(name, score=0.7 + place / 100, **KNOWN) for place, name in enumerate("ab")]
    table = build_table(rows)
    (line, _) = table.blocks[0].lines
    cells = dict(zip(table.columns, line.cells, strict=True))
    assert [cells[name] for name in IF_KNOWN if name in cells] == ["0.1234", "0.0000 … 0.2000", "0.0512"]
    (note,) = told(table, "Floor")
    assert "a/question 0.6875 N; b/question 0.6875 N." in note
    assert told(table, "True error (SIM)")
    assert to_markdown(rows).count("Floor") == 1
    (first, shown), _ = records(table)
    assert {key: first[key] for key in KNOWN} == KNOWN
    assert shown["beyond_floor"] == "0.1234"


def test_without_floors_a_table_has_no_columns_for_them():
    table = build_table([row("a"), row("b")])
    assert table.columns == tuple(name for name in COLUMNS if name not in IF_KNOWN)
    assert not told(table, "Floor")
    assert not told(table, "True error")


def test_the_order_is_that_of_the_errors_beyond_the_floor():
    noisier = row("a", score=0.75, **{**KNOWN, "reference_floor": 0.74, "score_beyond_floor": 0.1221})
    rows = [row("b", score=0.71, **{**KNOWN, "score_beyond_floor": 0.1774}), noisier]
    assert [line.cells[1] for line in build_table(rows).blocks[0].lines] == ["a SIM", "b SIM"]


@pytest.mark.parametrize(
    ("protocols", "tare", "said"),
    [
        (
            ["deployable"],
            7.2,
            "`deployable`: each recording is tared on its own unloaded hold before its press (7.2 s).",
        ),
        (["deployable-untared"], None, "`deployable-untared`: readings as they are."),
        (["karl2016"], None, ""),
        (["deployable"], None, ""),
    ],
)
def test_one_line_says_which_protocol_tares(protocols, tare, said):
    table = build_table([row(name, protocol=name, tare_s=tare) for name in protocols])
    found = told(table, "tared on its own") + told(table, "readings as they are")
    assert found == ([said] if said else [])


def test_both_are_told_in_one_line():
    rows = [row("a", tare_s=7.2), row("b", protocol="deployable-untared")]
    (note,) = told(build_table(rows), "tared on its own")
    assert note.endswith("(7.2 s); `deployable-untared`: readings as they are.")


def test_floors_of_several_campaigns_are_one_number_with_their_range():
    rows = [row("a", cell=str(n), repeat=n, repeats=2, **KNOWN | {"reference_floor": n / 5}) for n in (3, 4)]
    (note,) = told(build_table(rows), "Floor")
    assert "a/question 0.7071 N (of 2: 0.6000 … 0.8000)" in note

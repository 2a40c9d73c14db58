"""What stands together, what never does, and that the order rows come in decides nothing."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactbench.core.leaderboard.formats import plain_text
from tactbench.core.leaderboard.table import build_table
from tactbench.core.leaderboard.view import WHOLE
from tests.core.leaderboard.rendering import to_csv, to_json, to_latex, to_markdown

from .rows import row
from .strategies import some_rows


@settings(max_examples=50)
@given(some_rows(most=5), st.randoms(use_true_random=False))
def test_a_table_does_not_depend_on_the_order_of_its_rows(rows, rng):
    other = list(rows)
    rng.shuffle(other)
    for form in (to_json, to_csv, to_markdown, to_latex):
        assert form(rows) == form(other)


def test_equal_scores_stand_in_the_order_of_their_cells_however_they_come():
    rows = [row(name, cell=f"cell of {name}") for name in "cab"]
    for some in (rows, rows[::-1]):
        assert [line.cells[1] for line in build_table(some).blocks[0].lines] == ["a SIM", "b SIM", "c SIM"]


@settings(max_examples=50)
@given(some_rows(most=5))
def test_every_row_is_one_line_and_no_block_mixes_what_is_not_comparable(rows):
    blocks = build_table(rows).blocks
    assert sorted(line.row["cell"] for block in blocks for line in block.lines) == sorted(one["cell"] for one in rows)
    for block in blocks:
        done = [line.row for line in block.lines if line.row["status"] == "done"]
        assert len({(one["task"], one["protocol"], one["split"], one["simulated"]) for one in done}) <= 1
        if done and not done[0]["simulated"]:
            assert len({one["rig"] for one in done}) == 1


def test_a_cell_that_was_not_begun_stands_with_those_of_its_rig():
    rows = [row(), row("b", status="failed", score=None, simulated=False, split=None, reason="no")]
    (block,) = build_table(rows).blocks
    assert "SIM (twin)" in block.title
    assert [line.kind for line in block.lines] == ["result", "failed"]


def test_it_does_not_where_it_could_stand_in_two_places():
    rows = [row(), row("b", split="roles"), row("c", status="failed", score=None, split=None, reason="no")]
    assert [len(block.lines) for block in build_table(rows).blocks] == [1, 1, 1]


@pytest.mark.parametrize("status", ["failed", "crashed", "timeout", "out-of-memory"])
def test_a_stopped_cell_is_a_line_with_its_reason_and_the_command_to_look_into_it(status):
    rows = [row(), row("b", status=status, score=None, reason="the plug was pulled", signal=9)]
    table = build_table(rows)
    assert table.blocks[0].lines[-1].cells[1:4] == ("b SIM", "lasso", status.upper())
    for text in (to_markdown(rows), plain_text(table), to_latex(rows)):
        assert status.upper() in text
        assert f"{status} by signal 9: the plug was pulled. Look into it: tactbench why" in text
    for text in (to_csv(rows), to_json(rows)):
        assert "the plug was pulled" in text


def test_a_skipped_cell_says_why_and_asks_for_nothing():
    table = build_table([row("b", status="skipped", score=None, reason="b has no such stream.")])
    assert table.blocks[0].lines[0].kind == "skipped"
    assert [note for note in table.notes if "no such stream" in note] == [
        "b/question/lasso skipped: b has no such stream."
    ]


def test_cells_that_ended_alike_are_told_in_one_sentence():
    rows = [row(f"s{n:02d}", status="timeout", score=None, reason="60 s are over.") for n in range(20)]
    (note,) = [note for note in build_table(rows).notes if "60 s" in note]
    assert "s07/question/lasso and 12 more timeout: 60 s are over. Look into it: tactbench why s00/" in note
    (long,) = [
        note for note in build_table([row(status="failed", score=None, reason="x" * 9999)]).notes if "xx" in note
    ]
    assert len(long) < 1000


def test_published_figures_stand_apart_and_are_never_ranked():
    rows = [
        row(
            score=0.9, published=0.5, published_reference="Author 2020", published_remark="another model than ours; old"
        ),
        row("b", score=0.8, published=0.5, published_reference="Author 2020", published_remark=""),
    ]
    table = build_table(rows)
    (section,) = table.sections
    assert "not ranked" in section.title
    assert "#" not in section.columns
    assert [line[0] for line in section.lines] == ["0.5000", "0.5000"]
    assert [line[6:] for line in section.lines] == [
        ("another model than ours", "Author 2020", "old"), ("their lasso", "Author 2020", ""),
    ]  # fmt: skip
    assert [line.cells[0] for line in table.blocks[0].lines] == ["1", "2"]  # both are worse than what is published
    for text in (to_markdown(rows, view=WHOLE), to_latex(rows, view=WHOLE), plain_text(table, view=WHOLE)):
        assert "Published figures" in text
    assert "published figures: `tactbench leaderboard --wide`" in plain_text(table)
    assert build_table([row()]).sections == ()


def test_shuffled_rows_and_probes_come_after_what_is_kept_apart():
    rows = [row(split="shuffled"), row(protocol="first-frame"), row(split="trial"), row(task="another", split="z")]
    random.Random(1).shuffle(rows)
    titles = [block.title for block in build_table(rows).blocks]
    assert [title.split(" · ")[0] for title in titles] == ["another", "question", "question", "question"]
    assert "split trial" in titles[1]
    assert "first-frame" in titles[2]
    assert "split shuffled" in titles[3]

"""What people see of a table: which columns under which headings, which notes, which commands."""

import io
import sys

import pytest

from tactbench.core.errors import UnknownNameError, UsageError
from tactbench.core.leaderboard.columns import COLUMNS
from tactbench.core.leaderboard.formats import plain_text
from tactbench.core.leaderboard.records import xlsx
from tactbench.core.leaderboard.table import build_table
from tactbench.core.leaderboard.view import (
    DEFAULT_VIEW,
    WHOLE,
    View,
    best,
    commands,
    footer,
    grids,
    known_columns,
    notes,
)
from tactbench.core.tables.fitting import fit, pieces, wrapped
from tests.core.leaderboard.rendering import to_markdown

from .rows import row
from .test_force import KNOWN

OVER = {"n_replicates": 8, "replicate_unit": "replicate"}


def heads(rows, view=DEFAULT_VIEW):
    (grid,) = grids(build_table(rows), view)
    return grid.headers


def test_eight_columns_are_shown_and_the_score_is_headed_by_metric_and_unit():
    assert heads([row()]) == (
        "#", "sensor", "estimator", "RMSE [N]", "95 % interval", "published", "delay", "fit",
    )  # fmt: skip
    assert heads([row(metric="accuracy", unit="1")])[3] == "accuracy"


def test_errors_beyond_a_floor_stand_beside_the_error_with_the_interval_that_ranks_go_by():
    assert heads([row(**KNOWN)]) == (
        "#", "sensor", "estimator", "RMSE [N]", "beyond floor [N]", "95 % beyond", "published", "delay",
    )  # fmt: skip
    (grid,) = grids(build_table([row(**KNOWN)]), DEFAULT_VIEW)
    assert grid.lines[0][4:6] == ("0.1234", "0.0000 … 0.2000")


def test_all_columns_that_say_something_are_shown_if_asked_for():
    shown = heads([row(sim_s=1.0)], WHOLE)
    assert {"latency p50", "n test", "sim", "cell"} <= set(shown)
    assert "published" not in shown


def test_chosen_columns_stand_in_the_order_asked_for_by_either_name_and_unknown_ones_are_refused():
    view = View(columns=known_columns(["cell", "score", "rank", "cell"]))
    (grid,) = grids(build_table([row()]), view)
    assert grid.columns == ("cell", "score", "#")
    assert grid.lines == (("a/question/twin/deployable:session/lasso", "0.5000", "1"),)
    with pytest.raises(UnknownNameError, match=r"Did you mean 'score'.*Known: #, .*cell"):
        known_columns(["scor"])


def test_an_interval_says_over_what_it_is_where_a_block_agrees_on_it():
    rows = [row(name, **OVER) for name in "ab"]
    assert heads(rows)[4] == "95 % over 8 replicates"
    assert heads([row(**KNOWN, **OVER)])[5] == "95 % beyond, over 8 replicates"
    assert heads([rows[0], row("b", n_replicates=5, replicate_unit="session")])[4] == "95 % interval"
    assert heads([row(n_replicates=5, replicate_unit="session")])[4] == "95 % over 5 sessions"


def test_too_few_replicates_have_a_range_that_is_called_one():
    none = {"ci_low": None, "ci_high": None}
    few = row("a", n_replicates=3, score_min=0.4, score_max=0.75, **none)
    (grid,) = grids(build_table([few, row("b", n_replicates=1, **none)]), DEFAULT_VIEW)
    assert [line[4] for line in grid.lines] == ["range 0.4000 … 0.7500", "one replicate"]
    assert grid.headers[4] == "range"


def test_a_delay_is_shown_where_it_is_known():
    (grid,) = grids(build_table([row(answer_delay_ms=242.5), row("b", score=0.6)]), DEFAULT_VIEW)
    assert [line[6] for line in grid.lines] == ["242 ms", "–"]


def test_three_notes_are_shown_the_most_important_first_and_a_command_for_the_others():
    rows = [
        row(dagger=True, baseline=0.55, counts={"rows before the press begins": 3}, chosen={"k": 40}, **KNOWN),
        row("b", status="failed", score=None, reason="the plug was pulled"),
        row("c", stamps=["leaks"], dagger=True, **KNOWN),
    ]
    table = build_table(rows)
    shown = notes(table, DEFAULT_VIEW)
    assert [text[:9] for text in shown] == ["b/questio", "‡ leaks", "† test-se"]
    hidden = len(table.notes) - 3
    assert commands(table, DEFAULT_VIEW)[0].startswith(f"{hidden} more notes and all columns: `tactbench leaderboard")
    assert notes(table, WHOLE) == table.notes
    order = [next(n for n, note in enumerate(table.notes) if text in note) for text in (
        "Floor,", "not shown to be better", "chosen on validation", "before the press", "SIM:",
    )]  # fmt: skip
    assert order == sorted(order)


def test_the_provenance_is_one_line_unless_asked_for():
    table = build_table([row(made_by="x")], [{"tactbench": "1", "host": "h"}])
    assert len(table.footer) == 3
    assert footer(table, DEFAULT_VIEW) == table.footer[:1]
    assert footer(table, WHOLE) == table.footer


def test_the_commands_name_folder_and_cell():
    table = build_table([row()])
    told = commands(table, View(folder="my results"))
    assert told == (
        "1 more note and all columns: `tactbench leaderboard 'my results' --notes --wide`."
        if len(table.notes) == 4
        else "All columns: `tactbench leaderboard 'my results' --wide`.",
        "What a row rests on, its delay part by part: "
        "`tactbench why a/question/twin/deployable:session/lasso --out 'my results'`.",
    )
    assert told[1] in plain_text(table, view=View(folder="my results"))
    assert len(commands(table, WHOLE)) == 1


def test_a_chosen_window_is_told_with_its_unit_and_what_it_is():
    (note,) = [text for text in build_table([row(chosen={"k": 40, "lambda_": 0.2})]).notes if "chosen" in text]
    assert note == (
        "a/question/lasso: chosen on validation data: k = 40 samples before the newest in the mean filter, "
        "lambda = 0.2 (parameter of lasso)."
    )


def test_the_best_of_each_sensor_keep_the_places_they_have_among_all():
    rows = [row(name, estimator, score=score) for name, estimator, score in (
        ("a", "lasso", 0.5), ("a", "ols", 0.6), ("b", "lasso", 0.7), ("b", "mean", 1.4),
    )]  # fmt: skip
    table = best(build_table(rows), 1)
    (grid,) = grids(table, DEFAULT_VIEW)
    assert [line[:3] for line in grid.lines] == [("1", "a SIM", "lasso"), ("3", "b SIM", "lasso")]
    assert "places are those among all answers" in to_markdown_of(table)
    assert [len(block.lines) for block in best(build_table(rows), 2).blocks] == [3]


def to_markdown_of(table):
    from tactbench.core.leaderboard.formats import markdown

    return markdown(table)


def test_no_sign_of_plus_or_minus_stands_for_an_interval():
    assert "±" not in to_markdown([row(**KNOWN)], view=WHOLE) + plain_text(build_table([row(**OVER)]))


def test_texts_are_broken_at_spaces_and_commas_and_never_before_a_mark():
    assert pieces("0.0000 … 0.2208") == ["0.0000 … ", "0.2208"]
    assert pieces("0.6928 †") == ["0.6928 †"]
    assert pieces("95 % over 8") == ["95 % ", "over ", "8"]
    assert wrapped("forest (a=1, b=2)", 10, len) == ["forest", "(a=1, b=2)"]
    assert wrapped("unbreakable", 4, len) == ["unbreakable"]


def test_columns_go_only_where_broken_texts_do_not_fit():
    headers, lines = ("one", "two"), [("a long text", "number")]
    natural = fit(headers, lines, {0}, room=20, gap=2, measure=len, first_to_go=[1])
    assert natural == ({0: 11, 1: 6}, [])
    broken = fit(headers, lines, {0}, room=12, gap=2, measure=len, first_to_go=[1])
    assert broken == ({0: 4, 1: 6}, [])
    assert fit(headers, lines, {0}, room=11, gap=2, measure=len, first_to_go=[1]) == ({0: 11}, [1])


def test_a_workbook_has_a_sheet_a_block_with_numbers_and_no_formula():
    from openpyxl import load_workbook

    rows = [row("=1+1", score=0.25, published=0.7), row("b", protocol="karl2016", estimator="mean")]
    book = load_workbook(io.BytesIO(xlsx(build_table(rows, [{"host": "h"}]))))
    assert book.sheetnames == ["1 question deployable", "2 question karl2016", "notes"]
    title, names, values = book["1 question deployable"].iter_rows(values_only=True)
    assert title[0].startswith("question · RMSE")
    read = dict(zip(names, values, strict=True))
    assert (read["score: RMSE [N]"], read["published"], read["rank"], read["rank_tied"]) == (0.25, 0.7, 1, False)
    assert (read["sensor"], read["n_test"]) == ("=1+1", 4400)
    assert {one.data_type for line in book["1 question deployable"] for one in line if one.value == "=1+1"} == {"s"}
    assert any("SIM" in str(one) for (one,) in book["notes"].iter_rows(values_only=True))


def test_a_workbook_without_openpyxl_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(UsageError, match=r"pip install 'tactbench\[xlsx\]'"):
        xlsx(build_table([row()]))


def test_every_column_can_be_asked_for():
    assert known_columns([*COLUMNS, "cell"]) == (*COLUMNS, "cell")

import csv
import io
import json

import pytest
from rich.console import Console

from tactbench.core.leaderboard.formats import show
from tactbench.core.leaderboard.notes import count_texts
from tactbench.core.leaderboard.records import JSON_KEYS, OF_REPLICATES, RANK_KEYS
from tactbench.core.leaderboard.table import build_table
from tactbench.core.leaderboard.view import DEFAULT_VIEW, WHOLE
from tactbench.core.tables.numbers import duration, score
from tests.core.leaderboard.rendering import to_csv, to_json, to_latex, to_markdown

from .rows import row


def test_lower_is_better_is_ranked_upwards_and_baselines_have_no_rank():
    table = build_table([row("a", score=0.7), row("b", score=0.5), row("a", "mean", score=1.4)])
    (block,) = table.blocks
    assert [(line.cells[0], line.cells[1], line.kind) for line in block.lines] == [
        ("1", "b SIM", "result"), ("2", "a SIM", "result"), ("base", "a SIM", "baseline"),
    ]  # fmt: skip


def test_higher_is_better_is_ranked_downwards():
    rows = [row(name, score=value, metric="macro_f1", unit="1") for name, value in (("a", 0.7), ("b", 0.9))]
    assert [line.cells[1] for line in build_table(rows).blocks[0].lines] == ["b SIM", "a SIM"]


def test_equal_scores_share_a_rank():
    lines = build_table([row("a"), row("b"), row("c", score=0.9)]).blocks[0].lines
    assert [line.cells[0] for line in lines] == ["1=", "1=", "3"]


def test_sim_and_hardware_protocols_and_splits_never_share_a_block():
    rows = [row(), row("b", simulated=False), row("c", protocol="karl2016"), row("d", split="shuffled")]
    assert len(build_table(rows).blocks) == 4


def test_a_failed_row_stands_in_the_table_with_its_reason():
    table = build_table([row(), row("b", status="failed", score=None, reason="the plug was pulled")])
    assert table.blocks[0].lines[-1].cells[3] == "FAILED"
    assert any("the plug was pulled" in note for note in table.notes)


def test_an_answer_no_better_than_the_trivial_one_is_called_that():
    """Only where its whole interval says so; where that holds the trivial score, it is not shown to be better."""
    rows = [row(score=1.35, baseline=1.4), row("b", score=0.5, baseline=1.4), row("c", score=1.6, baseline=1.4)]
    notes = [note for note in build_table(rows).notes if "trivial" in note]
    assert [note.split(", 1.4")[0] for note in notes] == [
        "a/question/lasso (deployable, split session) is not shown to be better than the trivial baseline",
        "c/question/lasso (deployable, split session) is no better than the trivial baseline",
    ]


def test_the_trivial_answer_that_wins_is_named_whatever_it_looks_at():
    common = {"baseline": 1.4, "simulated": False, "rig": "replay"}
    trivial = [
        row(estimator="mean", score=1.4, is_baseline=True, looks_at="nothing", **common),
        row(estimator="time-index", score=0.17, is_baseline=True, looks_at="time", **common | {"baseline": 0.17}),
    ]
    notes = build_table([row(estimator="forest", score=0.5, **common), *trivial]).notes
    (note,) = [note for note in notes if "no better" in note]
    assert note == (
        "a/question/forest (deployable, split session) is no better than the trivial time-index, which reads no "
        "sensor, only the time, 0.1700 N; see how the recordings differ before blaming the sensor: "
        "`tactbench run --sensor a --task question --rig replay --recordings DIR --probe`."
    )


def test_notes_name_the_split_they_speak_of_where_there_are_several():
    known = {"counts": {"rows lost": 3}, "ci_method": "jackknife", "looks_at": "features", "reference_floor": 0.1}
    one, other = row(**known), row(split="press", **known | {"counts": {"rows lost": 4}, "ci_method": "blocks"})
    notes = build_table([one, other, row("b", split="press", **known)]).notes
    for text in (
        "a/question (split session): rows lost: 3.", "a/question (split press): rows lost: 4.",
        "question (split press): interval by blocks.", "question: interval by jackknife.",
    ):  # fmt: skip
        assert text in notes
    (floor,) = [note for note in notes if note.startswith("Floor")]
    assert "a/question (split session) 0.1000 N" in floor
    assert "a/question (split press) 0.1000 N" in floor
    assert not any("(split" in note for note in build_table([one]).notes)


def test_marks_are_explained():
    table = build_table([row(dagger=True, stamps=["leaks: rows of one press are on both sides"])])
    assert table.blocks[0].lines[0].cells[3].endswith("† ‡")
    assert any(note.startswith("†") for note in table.notes)
    assert any("rows of one press" in note for note in table.notes)
    assert any(note.startswith("SIM") for note in table.notes)


def test_json_and_csv_hold_every_key_of_every_row():
    rows = [row(), row("b", status="failed", score=None)]
    keys = (*JSON_KEYS, *OF_REPLICATES, *RANK_KEYS, "shown")
    assert [tuple(entry) for entry in json.loads(to_json(rows))] == [keys, keys]
    read = list(csv.DictReader(io.StringIO(to_csv(rows))))
    assert float(read[0]["score"]) == 0.5
    assert read[1]["score"] == ""


@pytest.mark.parametrize("text", [to_markdown, to_latex])
def test_names_from_plugins_cannot_break_a_table(text):
    shown = text([row("a|b<script>&_%")])
    assert "<script>" not in shown.replace(r"\&", "") or text is to_latex
    assert r"a|b" not in shown or text is to_latex
    if text is to_latex:
        assert r"\&\_\%" in shown
        assert r"\toprule" in shown


def test_markup_in_a_name_is_text_on_the_terminal():
    out = io.StringIO()
    show(build_table([row("[bold red]a[/]")]), Console(file=out, width=200))
    assert "[bold red]a[/]" in out.getvalue()


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(None, "–"), (12.34, "12.3 s"), (0.01234, "12.3 ms"), (2e-5, "20.0 µs"), (100.4, "100 s"), (0, "0 s"),
     (0.9999, "1.00 s")],
)  # fmt: skip
def test_durations_have_three_digits_and_a_unit(seconds, text):
    assert duration(seconds) == text


def test_scores_with_a_unit_have_four_decimals():
    assert (score(0.68754, "N"), score(0.60488, "1"), score(None, "1")) == ("0.6875", "0.605", "–")


def test_a_narrow_terminal_breaks_texts_between_words_then_drops_columns_and_says_so():
    def shown(width, view=DEFAULT_VIEW):
        out = io.StringIO()
        show(build_table([row("a-sensor-of-some-name", sim_s=1.0)]), Console(file=out, width=width), view)
        assert max(len(line.rstrip()) for line in out.getvalue().splitlines()) <= width
        return out.getvalue()

    place = next(n for n, line in enumerate(shown(90).splitlines()) if "a-sensor-of-some-name" in line)
    first, second = shown(90).splitlines()[place : place + 2]
    assert "0.5000" in first
    assert second.strip() == "SIM"
    assert "too narrow" not in shown(90)
    assert "too narrow for: fit. They are in the files" in shown(80)
    assert "too narrow for: cell, batch/row" in shown(80, WHOLE).replace("\n ", " ")
    assert "a-sensor-of-some-name SIM" in shown(240, WHOLE)
    assert "too narrow" not in shown(240, WHOLE)


def test_counts_are_summed_over_sets_and_the_busiest_channels_come_first():
    counts = {
        f"{one} rows with T{place} beyond three sigma": place for one in ("training", "test") for place in range(7)
    }
    counts |= {f"{one} rows before the press begins": 600 for one in ("training", "test")}
    assert count_texts(counts) == [
        "rows before the press begins: 1200",
        "rows beyond three sigma in T6 12, T5 10, T4 8, T3 6 and 3 more channels",
    ]


def test_latex_keeps_ordinary_spaces_and_sets_thin_ones_in_numbers():
    text = to_latex([row(n_test=4400)])
    assert r"4\,400" in text
    assert "lower is better" in text


def test_notes_that_say_the_same_of_several_answers_are_one():

    from tactbench.core.leaderboard.notes import interval_notes

    method = "block bootstrap in time within 5 recordings (blocks of {} rows): spread between sessions is not in it"
    rows = [{"task": "curvature", "is_baseline": False, "ci_method": method.format(blocks)} for blocks in (17, 198)]
    (told,) = interval_notes(rows)
    assert told.endswith("within 5 recordings: spread between sessions is not in it.")
    (alone,) = interval_notes(rows[:1])
    assert "(blocks of 17 rows)" in alone

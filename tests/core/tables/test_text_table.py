"""Tables: what is sorted, what is left out, how they are rendered; text that would act is shown."""

import builtins
import math
import shlex
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.tables.markup import html, markdown
from tactbench.core.tables.terminal import plain_text
from tactbench.core.tables.text import (
    Entry,
    TextTable,
    command_line,
    cut,
    delay,
    duration,
    field_text,
    finite,
    interval,
    json_text,
    records_table,
    score,
    score_with_unit,
    signed,
    sort_value,
    text_table,
    visible,
    whole,
)


def test_only_a_bare_finite_number_is_sorted_as_one_since_lines_may_have_several_units():
    texts = ("4\u202f395", "−3", "-1e-3", "10.2 ms", "–", "base", Entry("10.2 ms", 0.0102))
    assert [sort_value(text) for text in texts] == [4395, -3, -1e-3, None, None, None, 0.0102]
    assert [finite(value) for value in (1, 0.5, math.nan, math.inf, None, "1", True)] == [1, 0.5, *[None] * 5]


def test_a_column_that_says_nothing_is_not_shown_and_markdown_escapes_what_would_break_the_table():
    table = text_table("t|t", ("a", "b", "n"), [("x|<b>", "–", "1")], numeric=("b", "n"), notes=("note",))
    lines = markdown([table]).splitlines()
    assert [line.strip("| ").replace(" ", "") for line in lines[2:5]] == ["a|n", "---|---:", "x\\|&lt;b>|1"]
    assert lines[6] == "- note"
    assert plain_text([text_table("nothing", ("a",), [])]).startswith("nothing\n")


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (score(0.12345, "1"), "0.123"), (score(9.99994, "N"), "9.9999"), (score(10.0, "N"), "10.00"),
        (score(-10.0, "N"), "-10.00"), (score(-9.5, "N"), "-9.5000"), (score(None, "N"), "–"),
        (interval(0.1, 0.2, "1"), "0.100 … 0.200"), (interval(0.1, None, "1"), "0.100 … open"),
        (interval(None, 0.2, "1"), "–"), (signed(0.0, "1"), "+0.000"), (signed(-0.5, "N"), "−0.5000"),
        (score_with_unit(0.5, "1"), "0.500"), (score_with_unit(0.5, "N"), "0.5000 N"),
        *((duration(seconds), text) for seconds, text in (
            (None, "–"), (0.0, "0.00 s"), (9e-7, "0.90 µs"), (9.994e-4, "999 µs"), (9.996e-4, "1.00 ms"),
            (9.994e-3, "9.99 ms"), (9.996e-3, "10.0 ms"), (0.09994, "99.9 ms"), (0.09996, "100 ms"), (0.9996, "1.00 s"),
            (1234.0, "1234 s"))),
        (delay(None, {}), "–"), (delay(2.0, {"window": 1.0}), "≥ 2.00 ms"), (delay(2.0, None), "2.00 ms"),
        (delay(2.0, {"window": 1.0, "link": 0.0}), "2.00 ms"), (delay(2.0, {"prediction": 1.0}), "2.00 ms"),
        (whole(4400), "4\u202f400"), (whole(None), "–"), (cut("abcd", 4), "abcd"), (cut("abcde", 4), "abc…"),
        (field_text({"a": [1, None, True], "b": None, "c": 0.123456}), "a = 1, , yes, c = 0.12346"),
        (json_text({"a": [math.nan, -math.inf, (1.5,)]}), '{"a": [null, null, [1.5]]}'), (json_text("é"), '"\\u00e9"'),
    ],
)  # fmt: skip
def test_numbers_and_values_are_shown_with_the_digits_that_they_need(shown, expected):
    assert shown == expected


def test_records_are_a_table_whose_numbers_are_sorted_and_long_texts_are_prose():
    table = records_table("t", [{"a": 1.5, "b": "x"}, {"b": "y" * 60, "c": None}])
    assert (table.columns, table.lines) == (("a", "b"), (("1.5", "x"), ("", "y" * 60)))
    assert (table.right, table.wordy, sort_value(table.lines[0][0])) == ((True, False), False, 1.5)
    assert records_table("t", [{"b": "y" * 61}], ("b",)).wordy
    shown = html([replace(table, summary=("<1",), notes=("n",))])
    assert shown.count("text-align: right") == shown.count("text-align: left") == 2
    assert [text in shown for text in ("&lt;1", ">1.5<", "n<br>", "<th>b</th>")] == [True] * 4


def test_text_is_returned_in_a_notebook_too(monkeypatch):
    shell = type("ZMQInteractiveShell", (), {})()  # what rich looks for in a Jupyter kernel
    monkeypatch.setattr(builtins, "get_ipython", lambda: shell, raising=False)
    assert plain_text([("note",)]) == " note\n"


def test_a_narrow_terminal_leaves_columns_out_then_cuts_words_but_for_what_is_typed_elsewhere():
    table = TextTable("t", ("name", "n"), (("a", "1.0\n0.5…1.5"), ("b", "2.0")), frozenset({"n"}), origin="o")
    assert plain_text([table, ("note",)]).splitlines() == [
        "t            o", "", " name        n", " a         1.0", "       0.5…1.5", " b         2.0", "", " note",
    ]  # fmt: skip
    line = ("x" * 60, "y" * 20, "z" * 9)
    table = TextTable("t", ("name", "cell", "more"), (line,), unbroken=frozenset({"cell"}), first_to_go=("more",))
    text = plain_text([table], 40)
    assert max(map(len, text.splitlines())) <= 40
    assert "y" * 20 in text
    assert text.count("x") == 60
    assert text.endswith(" more.\n"), "which column was left out"


def test_controls_are_written_out():
    shown = {
        "plain é 中": "plain é 中", "\x1b[2J": "\\x1b[2J", "a\r\nb\tc": "a  b c", "\u202e": "\\u202e",
        "\ud800": "\\ud800",
        "\U000e0001": "\\U000e0001", "\u00a0": " ", "\x9b": "\\x9b",
    }  # fmt: skip
    assert {text: visible(text) for text in shown} == shown


@given(st.text(st.characters(exclude_categories=())))
def test_all_text_becomes_printable_once_and_for_all(text):
    assert visible(text).isprintable()
    assert visible(visible(text)) == visible(text)
    visible(text).encode()


def test_a_command_is_one_that_a_shell_reads_back_word_by_word():
    words = ("tactbench", "why", "a/force,n=5/1; rm -rf ~", "--out", "two words")
    assert shlex.split(command_line(*words)) == list(words)
    assert "\x1b" not in command_line("tactbench", "why", "\x1b[2J")

"""Tables: what is sorted, what is left out, how they are rendered; text that would act is shown."""

import builtins
import math
import shlex

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.tables.markdown import markdown
from tactbench.core.tables.terminal import plain_text
from tactbench.core.tables.text import command_line, visible
from tactbench.core.tables.text_table import Entry, TextTable, finite, sort_value, text_table


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

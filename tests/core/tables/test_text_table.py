"""Tables: what is sorted, what is left out, and how they are rendered."""

import math

from tactbench.core.tables.markdown import markdown
from tactbench.core.tables.terminal import plain_text
from tactbench.core.tables.text_table import Entry, TextTable, finite, sort_value, text_table


def test_only_a_bare_finite_number_is_sorted_as_one_since_lines_may_have_several_units():
    texts = ("4\u202f395", "−3", "-1e-3", "10.2 ms", "–", "base", Entry("10.2 ms", 0.0102))
    assert [sort_value(text) for text in texts] == [4395, -3, -1e-3, None, None, None, 0.0102]
    assert [finite(value) for value in (1, 0.5, math.nan, math.inf, None, "1", True)] == [1, 0.5, *[None] * 5]


def test_a_column_that_says_nothing_is_not_shown_and_markdown_escapes_what_would_break_the_table():
    table = text_table("t|t", ("a", "b", "n"), [("x|<b>", "–", "1")], numeric=("b", "n"), notes=("note",))
    lines = markdown([table]).splitlines()
    assert lines[2:] == ["| a | n |", "|---|---:|", "| x\\|&lt;b> | 1 |", "", "- note"]
    assert plain_text([text_table("nothing", ("a",), [])]).startswith("nothing\n")


def test_a_narrow_terminal_leaves_columns_out_then_cuts_words_but_for_what_is_typed_elsewhere():
    table = TextTable("t", ("name", "n"), (("a", "1.0\n0.5 … 1.5"), ("b", "2.0")), frozenset({"n"}), origin="o")
    assert plain_text([table, ("note",)]).splitlines() == [
        "t              o", "", " name          n", " a           1.0", "       0.5 … 1.5", " b           2.0", "",
        " note",
    ]  # fmt: skip
    line = ("x" * 60, "y" * 20, "z" * 9)
    table = TextTable("t", ("name", "cell", "more"), (line,), unbroken=frozenset({"cell"}), first_to_go=("more",))
    text = plain_text([table], 40)
    assert max(map(len, text.splitlines())) <= 40
    assert "y" * 20 in text
    assert text.count("x") == 60
    assert "Too narrow for: more." in text

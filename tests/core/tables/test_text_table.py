import math

from tactbench.core.tables.markdown import markdown
from tactbench.core.tables.text_table import Entry, finite, sort_value, text_table


def test_only_a_bare_number_is_sorted_as_one_since_lines_may_have_several_units():
    texts = ("4\u202f395", "−3", "-1e-3", "10.2 ms", "–", "", "base", Entry("10.2 ms", 0.0102))
    assert [sort_value(text) for text in texts] == [4395, -3, -1e-3, None, None, None, None, 0.0102]


def test_what_is_not_finite_cannot_be_sorted():
    assert [finite(value) for value in (1, 0.5, math.nan, math.inf, None, "1", True)] == [1, 0.5, *[None] * 5]


def test_a_column_that_says_nothing_is_not_shown():
    table = text_table("t", ("a", "b", "c"), [("1", "–", "x"), ("2", "", "y")], numeric=("a", "b"))
    assert table.columns == ("a", "c")
    assert table.right == (True, False)
    assert table.lines[1] == ("2", "y")


def test_markdown_escapes_what_would_break_the_table():
    text = markdown([text_table("t|t", ("a", "n"), [("x|<b>", "1")], numeric=("n",), notes=("note",))])
    assert text.splitlines()[2:] == ["| a | n |", "|---|---:|", "| x\\|&lt;b> | 1 |", "", "- note"]

import math

from tactbench.core.tables.markdown import markdown
from tactbench.core.tables.text_table import finite, sort_value, text_table


def test_a_bare_number_is_read_with_its_marks():
    read = {
        "0.6795 †": 0.6795,
        "4\u202f395": 4395,
        "−3": -3,
        "-1e-3": -1e-3,
        "62 %": 62,
        "0.5 † ‡": 0.5,
        "0.4 … 0.6": 0.4,
    }
    assert {text: sort_value(text) for text in read} == read


def test_text_with_a_unit_is_no_number_since_another_line_may_have_another_unit():
    assert [sort_value(text) for text in ("10.2 ms", "4 s", "–", "", "1 ms … 2 s", "base", "\u202f")] == [None] * 7


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

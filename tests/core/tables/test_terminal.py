"""Tables on a terminal."""

import pytest

from tactbench.core.tables.terminal import plain_text
from tactbench.core.tables.text_table import TextTable, text_table


def test_texts_of_several_lines_are_lines_of_the_table():
    table = TextTable("t", ("name", "n"), (("a", "1.0\n0.5 … 1.5"), ("b", "2.0")), frozenset({"n"}), origin="o")
    assert plain_text([table, ("note",)]).splitlines() == [
        "t              o", "", " name          n", " a           1.0", "       0.5 … 1.5", " b           2.0", "",
        " note",
    ]  # fmt: skip


def test_where_no_column_may_go_words_are_cut_but_for_what_is_typed_elsewhere():
    table = TextTable("t", ("name", "cell"), (("x" * 60, "y" * 20),), unbroken=frozenset({"cell"}))
    lines = plain_text([table], 40).splitlines()
    assert max(map(len, lines)) <= 40
    assert "y" * 20 in lines[3]
    assert sum(line.count("x") for line in lines) == 60


def test_columns_that_may_go_do_so_before_a_word_is_cut():
    table = TextTable("t", ("name", "more"), (("x" * 30, "y" * 30),), first_to_go=("more",))
    text = plain_text([table], 40)
    assert "x" * 30 in text
    assert "y" not in text
    assert "Too narrow for: more." in text


@pytest.mark.parametrize("lines", [[], [("", "–")]])
def test_a_table_that_says_nothing_has_a_title(lines):
    assert plain_text([text_table("nothing", ("a", "b"), lines)]).startswith("nothing\n")

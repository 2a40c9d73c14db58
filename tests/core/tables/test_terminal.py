"""Tables on a terminal."""

import pytest

from tactbench.core.tables.terminal import plain_text
from tactbench.core.tables.text_table import TextTable, text_table


def test_texts_of_several_lines_are_lines_of_the_table():
    table = TextTable("t", ("name", "n"), (("a", "1.0\n0.5 … 1.5"), ("b", "2.0")), frozenset({"n"}))
    assert plain_text([table]).splitlines()[2:] == [
        "  name           n", " ──────────────────", "  a            1.0", "         0.5 … 1.5",
        "  b            2.0", "",
    ]  # fmt: skip


def test_where_no_column_may_go_words_are_cut_but_for_what_is_typed_elsewhere():
    table = TextTable("t", ("name", "cell"), (("x" * 60, "y" * 20),), unbroken=frozenset({"cell"}))
    lines = plain_text([table], 40).splitlines()
    assert max(map(len, lines)) <= 40
    assert "y" * 20 in lines[4]
    assert sum(line.count("x") for line in lines) == 60


def test_columns_that_may_go_do_so_before_a_word_is_cut():
    table = TextTable("t", ("name", "more"), (("x" * 30, "y" * 30),), first_to_go=("more",))
    text = plain_text([table], 40)
    assert "x" * 30 in text
    assert "y" not in text.partition("This terminal")[0]
    assert "This terminal is too narrow for: more." in text


@pytest.mark.parametrize("lines", [[], [("", "–")]])
def test_a_table_that_says_nothing_has_a_title(lines):
    assert plain_text([text_table("nothing", ("a", "b"), lines)]).startswith("nothing\n")


def test_notes_and_tables_stand_apart():
    table = TextTable("t", ("a",), (("1",),))
    assert plain_text([table, ("note",), table]).split("\n\n")[1:] == [
        "  a\n ───\n  1",
        " note",
        "t",
        "  a\n ───\n  1",
        "",
    ]

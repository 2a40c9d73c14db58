"""Text that acts instead of showing is shown."""

import shlex

from hypothesis import given
from hypothesis import strategies as st

from tactbench.core.tables.text import command_line, visible


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

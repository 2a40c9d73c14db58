"""Whoever stands at a rig."""

import os
import sys
from pathlib import Path

import pytest

from tactbench.core.cli.operator import TerminalOperator
from tactbench.core.errors import RigError
from tests.core.cli.terminals import on_terminal

ASKS_TWICE = """
from tactbench.core.cli.operator import TerminalOperator
from tactbench.core.errors import RigError
operator = TerminalOperator()
operator.prompt("Place the cap.")
print("placed", flush=True)
try:
    operator.prompt("Press.")
except RigError as error:
    print(error)
"""


def test_enter_answers_and_one_typed_before_does_not():
    with on_terminal(["-c", ASKS_TWICE]) as terminal:
        os.write(terminal.ours, b"\n")
        assert "Place the cap." in terminal.read_until("Ctrl-C to end.")
        os.write(terminal.ours, b"\n")
        assert "Press." in terminal.read_until("Ctrl-C to end.")
        os.write(terminal.ours, b"\x04")  # Ctrl-D; had the first Enter answered, the second would have answered this
        said = terminal.read_until(None)
        assert terminal.process.wait(30) == 0
    assert "left without an answer" in said


def test_without_a_terminal_somebody_has_to_be_there(monkeypatch):
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(RigError, match=r"Somebody has to be there: Place the cap\..*--yes"):
            TerminalOperator().prompt("Place the cap.")


def test_yes_goes_on(capsys):
    TerminalOperator(yes=True).prompt("Place the cap.")
    assert capsys.readouterr().err == "Place the cap.\n"

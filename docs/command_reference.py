"""Write ``docs/commands.md``: every verb with its arguments and options, as `--help` shows them.

Usage: python docs/command_reference.py
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from tactbench.core.cli import VERBS, cli

DOCUMENT = Path(__file__).resolve().parent / "commands.md"
_TITLE = """# Commands

Made by `python docs/command_reference.py` from what `tactbench VERB --help` shows. Exit codes: 0 all well, 1 something
failed or is not as it should be, 2 what was asked for cannot be, 130 interrupted. Results go to stdout, progress and
remarks to stderr.
"""


def reference() -> str:
    """Return the whole document."""
    context = click.Context(cli, info_name="tactbench")
    parts = [_TITLE]
    for verb in VERBS:
        command = cli.get_command(context, verb)
        assert command is not None
        parts += _described(command, f"tactbench {verb}", 2)
    return "\n".join(parts)


def _described(command: click.Command, words: str, level: int) -> Iterator[str]:
    """Yield the lines on a verb, and on those below it."""
    arguments = [one for one in command.params if isinstance(one, click.Argument)]
    usage = " ".join([words, *(_argument(one) for one in arguments)])
    yield f"{'#' * level} `{words}`\n\n`{usage}{' [OPTIONS]' if _options(command) else ''}`\n"
    yield inspect.cleandoc(command.help or "") + "\n"
    lines = [_option(one) for one in _options(command)]
    if lines:
        yield "\n".join(lines) + "\n"
    if isinstance(command, click.Group):
        for name in command.list_commands(click.Context(command)):
            below = command.get_command(click.Context(command), name)
            assert below is not None
            yield from _described(below, f"{words} {name}", level + 1)


def _options(command: click.Command) -> list[click.Option]:
    return [one for one in command.params if isinstance(one, click.Option) and not one.hidden]


def _argument(one: click.Argument) -> str:
    choices = one.type.choices if isinstance(one.type, click.Choice) else None
    name = "|".join(map(str, choices)) if choices and one.metavar is None else one.metavar or str(one.name).upper()
    shown = name if one.required else f"[{name}]"
    return f"{shown}…" if one.nargs == -1 else shown


def _option(one: click.Option) -> str:
    names = "`, `".join(" / ".join(pair) for pair in _spellings(one))
    value: Any = "" if one.is_flag or one.count else _value(one)
    told = (one.help or "").strip()
    if told and not told.endswith((".", "…")):
        told += "."
    if one.show_default and one.default not in (None, False, ()):
        told = f"{told} Default: `{one.default}`.".strip()
    return f"- `{names}{value}`" + (f": {told}" if told else "")


def _spellings(one: click.Option) -> list[list[str]]:
    return [[*one.opts, *one.secondary_opts]] if one.secondary_opts else [[name] for name in one.opts]


def _value(one: click.Option) -> str:
    if one.metavar:
        return f" {one.metavar}"
    if isinstance(one.type, click.Choice):
        return f" {'|'.join(map(str, one.type.choices))}"
    return f" {one.type.name.upper()}"


if __name__ == "__main__":
    DOCUMENT.write_text(reference(), encoding="utf-8")

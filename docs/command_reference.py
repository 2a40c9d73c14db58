"""The page ``commands.md``: every verb with its arguments and options, as `--help` shows them.

``conf.py`` writes the page when the site is built.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

import click

from tactbench.core.cli import cli

_TITLE = """# Commands

Generated from what `tactbench VERB --help` shows. Exit codes: 0 success, 1 something failed or was found wrong, 2 the
command cannot be carried out as given, 130 interrupted. Results go to stdout, progress and remarks to stderr.
"""


def reference() -> str:
    """Return the whole document."""
    context = click.Context(cli, info_name="tactbench")
    parts = [_TITLE]
    for verb in cli.list_commands(context):
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
    text = (one.help or "").strip()
    if text and not text.endswith((".", "…")):
        text += "."
    if one.show_default and one.default not in (None, False, ()):
        text = f"{text} Default: `{one.default}`.".strip()
    return f"- `{names}{value}`" + (f": {text}" if text else "")


def _spellings(one: click.Option) -> list[list[str]]:
    return [[*one.opts, *one.secondary_opts]] if one.secondary_opts else [[name] for name in one.opts]


def _value(one: click.Option) -> str:
    if one.metavar:
        return f" {one.metavar}"
    if isinstance(one.type, click.Choice):
        return f" {'|'.join(map(str, one.type.choices))}"
    return f" {one.type.name.upper()}"

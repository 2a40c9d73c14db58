"""The command line: one module for each command (verb), imported only when the command is called."""

from __future__ import annotations

import gc
import importlib
import io
import os
import signal
import sys
from typing import Any

import click

import tactbench
from tactbench.core.errors import TactbenchError, UnknownNameError
from tactbench.core.interrupts import Interrupted, end_alike
from tactbench.core.on_demand import contributed
from tactbench.core.tables.text import visible_lines
from tactbench.core.thread_limit import keep_threads

# verb -> (module in this folder, one line of help). The help stands here so that `--help` imports no verb.
VERBS = {
    "run": ("run", "Acquire, evaluate and rank: all of benchmarks.yaml, or what the options select."),
    "list": ("listing", "List sensors, rigs, tasks, estimators, effects and plugins."),
    "show": ("show", "Show sensors side by side, or details of anything else."),
    "record": ("record", "Record one scene into one file."),
    "inspect": ("inspect", "Show the contents of a recording, and check its health."),
    "import": ("import_", "Convert foreign tables, or a sensor's log, into recordings."),
    "datasets": ("datasets", "List public data sets that a run can name."),
    "leaderboard": ("leaderboard", "Print the table of all results in a folder, in any format."),
    "report": ("report", "Write one HTML page of all results, with figures and published numbers."),
    "compare": ("compare", "Compare two sensors, estimators or result folders, replicate by replicate."),
    "cost": ("cost", "Measure what accuracy costs in time."),
    "sensitivity": ("sensitivity", "Show which assumptions simulated scores rest on."),
    "choose": ("choose", "Find the sensor that meets given requirements."),
    "why": ("why", "Show the data behind a cell's score and its status; compute it again."),
    "merge": ("merge", "Merge result folders; refuse those that contradict each other."),
    "twin": ("twin", "Explain and verify the simulated rig."),
    "new": ("new", "Create a plugin package: a sensor, rig, task, estimator or effect."),
    "check": ("check", "Check whether a plugin conforms."),
}


class LazyGroup(click.Group):
    """A command group that lists its verbs by name and imports a verb when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the verbs in the order of typical use, then those that plugins contribute."""
        return [*VERBS, *contributed("tactbench.verbs")]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a verb; None for an option. Raises UnknownNameError, with the nearest name, for others."""
        if cmd_name.startswith("-"):
            return None
        if cmd_name in VERBS:
            found: click.Command = importlib.import_module(f"tactbench.core.cli.{VERBS[cmd_name][0]}").command
        elif cmd_name in (others := contributed("tactbench.verbs")):
            found = others[cmd_name].load()
        else:
            raise UnknownNameError("command", cmd_name, [*VERBS, *others])
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of verbs with their help; only verbs of plugins are imported for it."""
        rows = [(name, text) for name, (_, text) in VERBS.items()]
        rows += [(name, verb.load().short_help) for name, verb in contributed("tactbench.verbs").items()]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "show_default": True})
@click.version_option(tactbench.__version__, prog_name="tactbench")
def cli() -> None:
    """Benchmark tactile sensors, and show what each score costs in time.

    Start with:  tactbench run --sensor biotac --task curvature
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 success, 1 a cell or check failed, 2 wrong usage, 130 Ctrl-C (128 + signal)."""
    # Imports create thousands of lasting objects: with the default thresholds a sixth of their time is collection.
    gc.set_threshold(100_000, 50, 100)
    keep_threads()
    _open_streams()
    end_alike()
    try:
        code: Any = cli.main(args=arguments, prog_name="tactbench", standalone_mode=False)
        sys.stdout.flush()  # its buffer may be refused as well
    except (click.exceptions.Abort, KeyboardInterrupt) as error:
        code = _interrupted(arguments, error.__cause__ or error)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except BrokenPipeError:
        # The reader of the output has ended (`| head`).
        sys.stderr.close()
        _discard_output()
        code = 1
    except Exception as error:
        code = _report(error)
    sys.exit(code if isinstance(code, int) else 0)


def _open_streams() -> None:
    """Open closed standard streams on the null device and escape unprintable text, so that printing never fails."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:  # else a file that is opened later gets this number, and printed text
            stream = open(os.devnull, "w" if number else "r", errors="backslashreplace")  # noqa: PTH123, SIM115
            os.set_inheritable(stream.fileno(), True)
            setattr(sys, name, stream)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


_KEPT = dict.fromkeys(
    ("run", "sensitivity", "cost"), "Finished cells are kept; the same command continues from there."
) | {"emulate": "The emulated devices and their links are gone."}
"""Additional message when a verb is interrupted with Ctrl-C, by verb."""


def _interrupted(arguments: list[str] | None, error: BaseException) -> int:
    words = sys.argv[1:] if arguments is None else arguments
    click.echo(f"Interrupted. {_KEPT.get(words[0] if words else '', '')}".strip(), err=True)
    return 128 + (error.args[0] if isinstance(error, Interrupted) else signal.SIGINT)


def _discard_output() -> None:
    """Send standard output to the null device, so that flushing its buffer at exit raises no second error."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _report(error: Exception) -> int:
    if isinstance(error, OSError) and error.filename is None and error.strerror:
        click.echo(f"Error: The output cannot be written: {error.strerror}.", err=True)
        _discard_output()
        return 1
    if not isinstance(error, TactbenchError):
        raise error
    click.secho("Error: ", fg="red", bold=True, nl=False, err=True)
    click.echo(visible_lines(f"{error.message}\n  {error.hint}" if error.hint else error.message), err=True)
    return error.exit_code

"""Change the code of rooms of the package at random places, and print the changes that the rooms' own tests pass with.

Usage: nice python benchmarks/mutants.py COUNT SEED ROOM..., for instance `60 1 core/spec core/evaluation`. Each change
is made in a copy of the repository. A first run of the tests of a room notes which test files reach which line; each
change is then tried on those alone, or on all where an import or none of them reaches it. A change with which they pass
is printed; one with which they exceed three times their time is noticed.
"""

from __future__ import annotations

import ast
import contextlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import h5py  # noqa: F401  (imported once, before each run is forked)
import hypothesis.extra.numpy  # noqa: F401
import pytest
import scipy.stats  # noqa: F401
import sklearn.ensemble  # noqa: F401

TESTS = {"core/study": "core/cli"}
"""Rooms whose tests stand in the folder of another."""
SWAPS: dict[type[ast.AST], type[ast.AST]] = {}
for one, other in ((ast.Eq, ast.NotEq), (ast.Is, ast.IsNot), (ast.In, ast.NotIn), (ast.Lt, ast.LtE), (ast.Gt, ast.GtE),
                   (ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.And, ast.Or)):  # fmt: skip
    SWAPS |= {one: other, other: one}


def changed(node: ast.AST) -> str | None:
    """Return what is written in place of a node, or None where the node is left as it is."""
    match node:
        case ast.Compare(left, [operator], others) if type(operator) in SWAPS:
            return f"({ast.unparse(ast.Compare(left, [SWAPS[type(operator)]()], others))})"
        case ast.BinOp(left, operator, right) if type(operator) in SWAPS:
            return f"({ast.unparse(ast.BinOp(left, SWAPS[type(operator)](), right))})"
        case ast.BoolOp(operator, values):
            return f"({ast.unparse(ast.BoolOp(SWAPS[type(operator)](), values))})"
        case ast.UnaryOp(ast.Not(), operand):
            return f"({ast.unparse(operand)})"
        case ast.Constant(bool(value)):
            return str(not value)
        case ast.Constant(int(value) | float(value)):
            return str(value + 1)
        case ast.Return(value) if not (value is None or (isinstance(value, ast.Constant) and value.value is None)):
            return "return None"
        case ast.Raise():
            return "pass"
    return None


def mutants(path: Path) -> list[tuple[int, str, str, str, bool]]:
    """Return line, before, after, the whole changed source and whether the line lies in a function, of every change."""
    text = path.read_bytes()
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []

    def visit(node: ast.AST, inside: bool) -> None:
        after = changed(node)
        if after is not None and (not isinstance(node, ast.Constant) or ast.literal_eval(after) != node.value):
            begin = starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]
            end = starts[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]
            source = (text[:begin] + after.encode() + text[end:]).decode()
            found.append((node.lineno, text[begin:end].decode(), after, source, inside))  # type: ignore[attr-defined]
        if isinstance(node, ast.Raise | ast.JoinedStr):
            return  # the words of messages are left as they are
        for field, child in ast.iter_fields(node):
            body = inside or (isinstance(node, ast.FunctionDef) and field == "body")
            for one in child if isinstance(child, list) else [child]:
                if isinstance(one, ast.AST):
                    visit(one, body)

    visit(ast.parse(text), False)
    return found


class Reached:
    """A plugin of pytest that notes which files of tests reach which lines of a folder; of imports, ``""``."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.name = f"{folder}{os.sep}", ""
        self.lines: dict[str, set[str]] = defaultdict(set)
        self.seconds: dict[str, float] = defaultdict(float)

    def call(self, frame: FrameType, event: str, arg: object) -> Any:
        """Follow the lines of functions of the folder."""
        return self.line if frame.f_code.co_filename.startswith(self.folder) else None

    def line(self, frame: FrameType, event: str, arg: object) -> Any:
        """Note one line."""
        self.lines[f"{frame.f_code.co_filename}:{frame.f_lineno}"].add(self.name)
        return self.line

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Take the time of one test."""
        self.name, began = item.location[0], time.perf_counter()
        sys.settrace(self.call)
        result = yield
        self.seconds[self.name] += time.perf_counter() - began
        return result


def passes(copy: Path, tests: list[str], limit_s: float, reached: Reached | None = None) -> bool:
    """Return whether tests pass in a child process, which is ended with all that it started at its limit."""
    child = os.fork()
    if not child:
        os.setpgid(0, 0)
        os.chdir(copy)
        sys.path.insert(0, str(copy))
        output = os.open(copy / "output", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        for descriptor in (1, 2):
            os.dup2(output, descriptor)
        sys.settrace(reached and reached.call)
        options = ("-x", "-q", "--assert=plain", "-p", "no:cacheprovider")
        code = pytest.main([*options, *tests], plugins=[reached] if reached else [])
        sys.settrace(None)
        if reached:
            lines = {line: sorted(names) for line, names in reached.lines.items()}
            (copy / "reached.json").write_text(json.dumps([lines, reached.seconds]))
        os._exit(int(code))
    ended, status = time.monotonic() + limit_s, -1
    while time.monotonic() < ended and status < 0:
        done, found = os.waitpid(child, os.WNOHANG)
        status = found if done else -1
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if status < 0:
        os.waitpid(child, 0)
    return status == 0


def main(count: int, seed: int, rooms: list[str]) -> None:
    """Draw `count` changes over the modules of the rooms and try each."""
    os.environ["CI"] = "1"  # the same examples of hypothesis in every run
    root = Path(__file__).resolve().parents[1]
    sys.path[:] = [one for one in sys.path if Path(one).resolve() not in (root, root / "benchmarks")]
    copy = Path(tempfile.mkdtemp(prefix="mutants-")) / "copy"
    shutil.copytree(root, copy, ignore=shutil.ignore_patterns(".venv", ".git", "__pycache__", ".*_cache"))
    every = [
        (room, path, *one)
        for room in rooms for path in sorted((copy / "tactbench" / room).rglob("*.py")) for one in mutants(path)
    ]  # fmt: skip
    drawn = sorted(random.Random(seed).sample(every, min(count, len(every))), key=lambda one: one[:3])
    reached, survivors = {}, 0
    for place, (room, path, line, before, after, source, inside) in enumerate(drawn):
        if room not in reached:
            if not passes(copy, [f"tests/{TESTS.get(room, room)}"], 1800, Reached(copy / "tactbench" / room)):
                sys.exit(f"The tests of {room} fail before any change: {(copy / 'output').read_text()[-3000:]}")
            reached[room] = json.loads((copy / "reached.json").read_text())
        lines, seconds = reached[room]
        found = set(lines.get(f"{path}:{line}", ())) if inside else {""}
        # What imports reach, or only a process that the tests start, is tried on all of them.
        tests = sorted(seconds if not found or "" in found else found, key=seconds.__getitem__)
        whole = path.read_bytes()
        path.write_text(source)
        os.utime(path, (place, place))  # no compiled file of another change is taken for this one
        if passes(copy, tests, 30 + 3 * sum(map(seconds.__getitem__, tests))):
            survivors += 1
            print(f"{path.relative_to(copy)}:{line}: {before} -> {after}", flush=True)
        path.write_bytes(whole)
        os.utime(path, (10**6 + place, 10**6 + place))
    print(f"{len(drawn)} of {len(every)} changes, {survivors} survivors ({survivors / len(drawn):.1%})")
    shutil.rmtree(copy.parent)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])

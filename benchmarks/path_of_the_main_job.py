"""The functions that the main job passes through, in the order of their first call, and how many they are.

``tactbench run --sensor biotac --task curvature --repeats 1`` in an empty folder, watched with `sys.setprofile` in the
run's process and in those that it forks. Listed is every function of the package with its file, line and first caller;
comprehensions, lambdas and functions defined inside others are left out. Counted are all, and those of the command
line, the matrix and the process pool; those of the run's own process, and with those that only its forks reach. Frames
are those of the package from `main` to the deepest first call of a `fit`, over the fork.

Usage: python benchmarks/path_of_the_main_job.py [OPTION OF RUN]...
"""

from __future__ import annotations

import inspect
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

import tactbench
from tactbench.core.cli import main

PACKAGE = str(Path(tactbench.__file__).parent) + "/"
COUNTED = ("core/cli/", "core/matrix/", "core/pool/")


def _name(frame: FrameType | None) -> str:
    while frame is not None and not frame.f_code.co_filename.startswith(PACKAGE):
        frame = frame.f_back
    return "" if frame is None else f"{frame.f_code.co_filename.removeprefix(PACKAGE)}:{frame.f_code.co_qualname}"


def watch(path: Path) -> None:
    """Write a line for the first call of every function, in this process and those that it forks from now on."""
    seen = set()

    def called(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or code in seen:
            return
        seen.add(code)
        is_function = code.co_flags & inspect.CO_OPTIMIZED and "<" not in code.co_qualname  # bodies of classes are none
        if not is_function or not code.co_filename.startswith(PACKAGE):
            return
        frames, above = 1, frame.f_back
        while above is not None:
            frames += above.f_code.co_filename.startswith(PACKAGE)
            above = above.f_back
        with path.open("a") as lines:
            lines.write(f"{_name(frame)}\t{code.co_firstlineno}\t{_name(frame.f_back)}\t{frames}\t{os.getpid()}\n")

    sys.setprofile(called)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "functions"
        watch(found)
        try:
            main(["run", "--sensor", "biotac", "--task", "curvature", "--repeats", "1", "--out", f"{folder}/results",
                  *sys.argv[1:]])  # fmt: skip
        except SystemExit as end:
            if end.code:
                raise
        sys.setprofile(None)
        rows = [line.split("\t") for line in found.read_text().splitlines()]
    functions: dict[str, str] = {}
    own = {name for name, *_, process in rows if int(process) == os.getpid()}
    for name, line, caller, *_ in rows:
        functions.setdefault(name, f"{name} (line {line}) < {caller}{'' if name in own else '   [forked process]'}")
    print("\n".join(functions.values()))
    rooms = Counter(name.rpartition("/")[0] for name in own)
    for room, count in rooms.most_common():
        print(f"{count:>5}  {room}")
    for where, names in (("the run's process", own), ("all processes", functions)):
        counted = sum(name.startswith(COUNTED) for name in names)
        print(f"{where}: {len(names)} functions, {counted} of them in {', '.join(COUNTED)}")
    print(f"{max((int(row[3]) for row in rows if row[0].endswith('.fit')), default=0)} frames to fit")

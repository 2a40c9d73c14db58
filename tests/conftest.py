"""Fixtures of many tests: the real recordings, and the command line with packages of third parties on its path."""

from __future__ import annotations

import contextlib
import gc
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

from tactbench.core.pool import preload

# Continuous integration draws the same examples every time, so that a red run means a change. A deadline would test the
# machine.
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")

# Threads of numerical libraries wait for each other in a loop, which costs time slices beside other work.
os.environ.setdefault("OMP_NUM_THREADS", "1")

gc.set_threshold(100_000, 50, 100)  # the objects of thousands of tests live to the end


def pytest_collection_finish():
    """Leave the objects of test collection out of all later collections of garbage."""
    gc.collect()
    gc.freeze()


# Commands that tests start compile the package once.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# The fork server keeps the modules that it was started with. Without scikit-learn every cell of every test would import
# that again, which takes five times as long as the cell.
preload("tactbench.core.matrix.preloaded")

# A shell's background jobs ignore Ctrl-C, and so do their children: tests that send one would wait for ever.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parents[1]
THIRD_PARTY = ROOT / "tests" / "third_party"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real recordings; tests that need it are skipped where it is not."""
    path = Path(os.environ.get("TACTBENCH_DATA", ROOT.parent / "shared" / "data"))
    if not (path / "README.md").is_file():
        pytest.skip("the real recordings are not beside this checkout; set TACTBENCH_DATA to their folder")
    return path


class Shell:
    """Runs the command line in a fresh interpreter, in `folder`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(
        self, *arguments: str, plugins: tuple[str, ...] = (), code: int | None = 0
    ) -> subprocess.CompletedProcess[str]:
        path = os.pathsep.join([str(ROOT), *(str(THIRD_PARTY / name) for name in plugins)])
        env = {**os.environ, "PYTHONPATH": path, "COLUMNS": "200", "PYTHONWARNINGS": "error", "OMP_NUM_THREADS": "1"}
        done = subprocess.run(
            [sys.executable, "-m", "tactbench", *arguments],
            cwd=self.folder, env=env, capture_output=True, text=True, timeout=100, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        if code is not None:
            assert done.returncode == code, f"exit {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done


class Verbs:
    """Calls the command line in this process, in `folder`; with `here` recordings and cells are made in it too."""

    def __init__(self, folder: Path, *, here: bool = False) -> None:
        self.folder = folder
        self.here = here

    def __call__(
        self, *arguments: str, plugins: tuple[str, ...] = (), code: int | None = 0
    ) -> subprocess.CompletedProcess[str]:
        from tactbench.core.cli import main
        from tactbench.core.plugins.registry import installed
        from tests.here import forget, make_here

        thresholds, hook = gc.get_threshold(), sys.unraisablehook
        out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
        with (
            contextlib.chdir(self.folder),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            pytest.MonkeyPatch.context() as patch,
            Path(os.devnull).open() as nothing,
        ):
            patch.setenv("COLUMNS", "200")
            patch.setattr(sys, "stdin", nothing)
            if self.here:
                forget(())
                make_here(patch)
            for name in plugins:
                patch.syspath_prepend(THIRD_PARTY / name)
            if plugins:
                installed.cache_clear()
            try:
                with pytest.raises(SystemExit) as ended:
                    main(list(arguments))
            finally:
                gc.set_threshold(*thresholds)
                sys.unraisablehook = hook
                if plugins:
                    installed.cache_clear()
                if self.here:
                    forget([THIRD_PARTY / name for name in plugins])
        said, told = (stream.buffer.getvalue().decode() for stream in (out, err))  # type: ignore[attr-defined]
        if code is not None:
            assert ended.value.code == code, f"exit {ended.value.code}\n{said}\n{told}"
        return subprocess.CompletedProcess(arguments, ended.value.code, said, told)


@pytest.fixture
def verbs(tmp_path: Path) -> Verbs:
    """The command line in this process, in an empty folder."""
    return Verbs(tmp_path)


@pytest.fixture
def shell(tmp_path: Path) -> Shell:
    """The command line, in an empty folder."""
    return Shell(tmp_path)

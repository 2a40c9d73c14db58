"""A Dask scheduler and workers as people start them: processes of their own, on the loopback."""

import json
import os
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from tempfile import TemporaryDirectory

from tests.conftest import ROOT
from tests.core.pool.patience import until

LIGHT = "tests.core.pool.light_fork_server"
"""What Dask workers load whose cells need no library."""


class Started:
    """Processes that end with the test."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir(exist_ok=True)
        self._stack = ExitStack()
        scratch = TemporaryDirectory(prefix="tb-", ignore_cleanup_errors=True)
        self._scratch = self._stack.enter_context(scratch)
        file = folder / "scheduler.json"
        self.scheduler = self._start("dask_scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
        try:
            assert until(lambda: file.exists() and file.read_text().endswith("}"), 60)
            self.address = json.loads(file.read_text())["address"]
        except BaseException:
            self.close()
            raise

    def worker(self, *path, light=False):
        """Start a worker that sees the packages in the folders `path` first; `light`: for work without libraries."""
        where = self.folder / f"worker-{len(list(self.folder.iterdir()))}"
        where.mkdir()
        options = ("--nthreads", "1", "--no-dashboard", "--memory-limit", "0", "--local-directory", str(where))
        preload = ("--preload", LIGHT) if light else ()
        return self._start("dask_worker", self.address, "--no-nanny", *preload, *options, path=path, cwd=where)

    def _start(self, program, *arguments, path=(), cwd=None):
        log = self._stack.enter_context((self.folder / f"{program}.log").open("ab"))
        env = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, [*path, ROOT])), "OMP_NUM_THREADS": "1"}
        env["TMPDIR"] = self._scratch  # short: a socket of theirs has its path in there
        host = ("--host", "127.0.0.1")
        process = subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{program}", *arguments, *host],
            cwd=cwd or self.folder, env=env, stdout=log, stderr=log, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def close(self):
        self._stack.close()


@contextmanager
def started(folder):
    """Start a scheduler; end it, and its workers, afterwards."""
    processes = Started(folder)
    try:
        yield processes
    finally:
        processes.close()


def posing_as(folder, name, version):
    """Return a folder that makes `name` look like another version to a Python that has it on its path."""
    info = folder / f"{name}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    return folder

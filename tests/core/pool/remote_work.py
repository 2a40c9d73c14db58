"""Work for other processes: they find these functions by name."""

import os
import signal
import sys
import time
from pathlib import Path

from tactbench.core.errors import DataError


def square(number, concurrency=1):
    return number * number


def process(_, concurrency=1):
    """The process, its parent, its grandparent, and how many are at work at once."""
    return os.getpid(), os.getppid(), parent_of(os.getppid()), concurrency


def where(_, concurrency=1):
    return str(Path.cwd())


def is_imported(module, concurrency=1):
    return module in sys.modules


def parent_of(pid):
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def kill_worker():
    """Kill the Dask worker whose fork server has started this process, and never another process.

    Where the worker is gone already, the fork server has another parent by now.
    """
    worker = parent_of(os.getppid())
    words = Path(f"/proc/{worker}/cmdline").read_text()
    if "dask_worker" in words or "spawn_main" in words:
        os.kill(worker, signal.SIGKILL)


def misbehave(what, concurrency=1):
    if what == "raise":
        raise DataError("Nothing fits.", hint="Try again.")
    if what == "abort":
        os.abort()
    if what == "hang":
        time.sleep(1000)
    if what == "lambda":
        return lambda: None
    if what == "kill-parent":
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(1000)
    if what == "kill-worker":
        kill_worker()
        time.sleep(1000)
    return f"{what} is well"


def kill_once(job, concurrency=1):
    """Kill the worker the first time anybody asks, as a power cut would; `marks` remembers."""
    number, marks = job
    if number == 3:
        try:
            (marks / "killed").touch(exist_ok=False)
        except FileExistsError:
            pass
        else:
            kill_worker()
            time.sleep(1000)
    return number * number


def wait_for(job, concurrency=1):
    """Tell that it has begun, then wait to be let go."""
    begun, go = job
    begun.write_text(str(os.getpid()))
    while not go.exists():
        time.sleep(0.02)
    return "went"

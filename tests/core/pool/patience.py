"""Other processes: waited for with patience for a slow machine and no longer than needed, and ended with the test.

Also a limit on the files of this process, which stands for a full disk.
"""

import resource
import subprocess
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import psutil


@contextmanager
def ending(command, **options):
    """Start a process that is ended with the block, whatever happens in it."""
    with subprocess.Popen(command, **options) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def files_up_to(size):
    """Let no file of this process grow beyond `size` bytes; the block may set another limit."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(size):
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))

    limit(size)
    try:
        yield limit
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def gone(pid):
    """Whether a process has ended, or is only waiting to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except OSError:
        return True


def processes_in(folder):
    """Return the processes that were started in `folder` and are still there."""
    return [one.info for one in psutil.process_iter(["pid", "cwd", "cmdline"]) if one.info["cwd"] == str(folder)]


pause = threading.Event()


def until(true, seconds=30.0):
    """Wait until something is true, with patience for a slow machine."""
    ends = time.monotonic() + seconds
    while not true() and time.monotonic() < ends:
        pause.wait(0.01)
    return true()

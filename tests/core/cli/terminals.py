"""A process on a pseudo-terminal, and what stands on its screen."""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import sys
import termios
import time
from contextlib import contextmanager
from pathlib import Path

from tests.core.pool.patience import ending

ROOT = Path(__file__).parents[3]
CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
SHOW_CURSOR, HIDE_CURSOR = "\x1b[?25h", "\x1b[?25l"


class Terminal:
    """The user's end of a terminal that a process runs on."""

    def __init__(self, process, ours):
        self.process = process
        self.ours = ours
        self.seen = ""

    def read_until(self, text, seconds=60):
        """Read until `text` is in what came since the last call; without `text`, to the end."""
        since, until = len(self.seen), time.monotonic() + seconds
        while (text is None or text not in self.seen[since:]) and time.monotonic() < until:
            if not select.select([self.ours], [], [], 0.5)[0]:
                continue
            try:
                piece = os.read(self.ours, 65536)
            except OSError:  # the other side has closed
                break
            if not piece:
                break
            self.seen += piece.decode(errors="replace")
        return self.seen[since:]


def computed(done):
    """Return the numbers of the last lines of a run: answers found, of all, computed; recordings made."""
    (line,) = [line for line in done.stderr.splitlines() if "computed" in line]
    return [int(number) for number in re.findall(r"\d+", line)]


def plain(text):
    return CONTROL.sub("", text.replace("\r\n", "\n"))


@contextmanager
def on_terminal(command, *, columns=80, lines=24, cwd=None, path=(), **env):
    """Start Python with `command` as the foreground job of a new terminal."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))

    def own_terminal():
        signal.signal(signal.SIGINT, signal.default_int_handler)
        os.setsid()
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    around = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
    around |= {"TERM": "xterm-256color", "PYTHONPATH": os.pathsep.join([str(ROOT), *map(str, path)]), **env}
    streams = {"stdin": theirs, "stdout": theirs, "stderr": theirs}
    try:
        with ending([sys.executable, *command], cwd=cwd, env=around, preexec_fn=own_terminal, **streams) as process:
            os.close(theirs)
            yield Terminal(process, ours)
    finally:
        os.close(ours)

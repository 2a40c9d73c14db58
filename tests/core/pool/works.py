"""Works that go wrong in every way, for pools to carry out: real processes, real signals."""

import importlib
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np

from tactbench.core.errors import NotApplicable


def work(what):
    """Do `what`, and return it if that is possible at all."""
    name, _, argument = what.partition(" ")
    return getattr(sys.modules[__name__], name)(*argument.split())


def fine(*words):
    return " ".join(("fine", *words))


def whoami(*_):
    return os.getpid()


def neighbours(folder, number):
    """Return how many items are at work, this one included."""
    here = Path(folder)
    (here / f"begun-{number}").touch()
    (here / f"work-{number}").touch()
    others = len(list(here.glob("work-*")))
    (here / f"work-{number}").unlink()
    return others


def raises():
    raise ValueError("no such luck")


def runs_out():
    raise MemoryError


def refuses():
    raise NotApplicable("not this one", hint="Try another.")


def exits():
    sys.exit(3)


def interrupts():
    raise KeyboardInterrupt


def aborts():
    os.abort()


def vanishes():
    os._exit(0)


def terminates():
    os.kill(os.getpid(), signal.SIGKILL)


def closes():
    os.closerange(3, 256)


def unspeakable():
    return lambda: None


def eats():
    eaten = []
    while True:
        eaten.append(np.ones(2**17))


def hangs(begun=None):
    """Wait for ever; tell in a file who does."""
    print("hanging", flush=True)
    if begun is not None:
        aside = Path(f"{begun}.aside")
        aside.write_text(str(os.getpid()))
        aside.rename(begun)
    threading.Event().wait()


def prints():
    print("Python")
    os.write(1, b"below\n")
    os.system("echo child")
    raise ValueError("printed")


def floods():
    while True:
        os.write(1, b"x" * 2**16)


def feeds_a_child():
    """Have a process below one of its own take 100 MB, which no limit of this process can refuse."""
    code = "import threading; a = bytearray(100 * 2**20); threading.Event().wait()"
    subprocess.run(f"{sys.executable} -c '{code}'; true", shell=True)


def forks():
    os.fork()
    return "one"


def leaves():
    """Leave a process behind; tell its number."""
    return subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]).pid


def holds(path):
    try:
        hangs()
    finally:
        Path(path).write_text("closed")


def imports_and_fails(module):
    importlib.import_module(module).fail()

"""Works that go wrong in every way, for engines to carry out: real forks, real signals."""

import os
import signal
import sys
import time

import numpy as np

from tactbench.core.errors import NotApplicable


def work(what):
    """Do `what`, and return it if that is possible at all."""
    return getattr(sys.modules[__name__], what)()


def fine():
    return "fine"


def raises():
    raise ValueError("no such luck")


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


def hangs():
    print("about to hang")
    while True:
        time.sleep(60)


def deaf():
    for number in (signal.SIGTERM, signal.SIGALRM, signal.SIGUSR2, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    hangs()


def eats():
    eaten = []
    while True:
        eaten.append(np.ones(2**17))


def terminates():
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(60)


def kills():
    os.killpg(0, signal.SIGKILL)


def prints():
    print("from Python")
    os.write(1, b"from below\n")
    os.system("echo from a child")
    return "printed"


def chatters():
    for _ in range(40):
        os.write(1, b"x" * 2**17)
    os.write(1, b"the end\n")
    return "chattered"


def forks():
    os.fork()
    return "one"


def leaves():
    """Leave a process behind; tell its number."""
    child = os.fork()
    if child == 0:
        time.sleep(600)
        os._exit(0)
    return child


def flees():
    """Leave a process behind that has left group and parent; tell its number."""
    reading, writing = os.pipe()
    if os.fork() == 0:
        os.setsid()
        grandchild = os.fork()
        if grandchild:
            os.write(writing, str(grandchild).encode())
            os._exit(0)
        time.sleep(600)
        os._exit(0)
    return int(os.read(reading, 20))


def unspeakable():
    return lambda: None


def whoami():
    return os.getpid()


def closes():
    os.closerange(3, 256)
    return "closed"

"""The code behind the estimators. What they do, they do when they are taught; otherwise they answer the mean."""

import os
import signal
import sys
import time

import numpy as np


class Mean:
    """Answers the mean of what it was taught, or the first class."""

    def __init__(self, teach=None, answer=None):
        self.teach, self.answer = teach, answer

    def fit(self, X, y):
        self.value = y[0] if y.dtype.kind in "iu" else float(np.mean(y))
        if self.teach is not None:
            self.teach()
        return self

    def predict(self, X):
        honest = np.full(len(X), self.value)
        return honest if self.answer is None else self.answer(honest)


def _estimator(teach=None, answer=None):
    return lambda *, kind, seed, threads: Mean(teach, answer)


def _raise():
    raise RuntimeError("out of breath\nand of words")


def _interrupt():
    raise KeyboardInterrupt


def _hang():
    while True:
        time.sleep(3600)


def _eat():
    eaten = []
    while True:
        eaten.append(np.ones(2**20))


def _print():
    print("said by print in process", os.getpid())
    sys.stderr.write("said to stderr\n")
    os.write(1, b'{"said": "to descriptor 1"}\n')
    os.system("echo said by a child")


_forked = []


def _fork():
    if not _forked:
        _forked.append(True)
        os.fork()


def _kill():
    os.killpg(0, signal.SIGKILL)


def _built(first):
    """Return what does something when it is built, and answers honestly."""

    def build(*, kind, seed, threads):
        first()
        return Mean()

    return build


evil_built_elsewhere = _built(lambda: os.chdir("/"))
evil_raise = _estimator(_raise)
evil_exit = _estimator(lambda: sys.exit("I am off"))
evil_interrupt = _estimator(_interrupt)
evil_abort = _estimator(os.abort)
evil_vanish = _estimator(lambda: os._exit(0))
evil_hang = _estimator(_hang)
evil_eat = _estimator(_eat)
evil_shape = _estimator(answer=lambda honest: honest[:-1])
evil_nan = _estimator(answer=lambda honest: honest * np.nan)
evil_text = _estimator(answer=lambda honest: honest.astype(str))
evil_print = _estimator(_print)
evil_fork = _estimator(_fork)
evil_kill = _estimator(_kill)

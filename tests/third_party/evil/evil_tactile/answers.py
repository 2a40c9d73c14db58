"""The code behind the estimators. What they do, they do when they are taught; otherwise they answer the mean."""

import os
import resource
import signal
import stat
import sys
import time
from pathlib import Path

import numpy as np

from tactbench.core.evaluation import metrics


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


def _deaf():
    for number in set(signal.valid_signals()) - {signal.SIGKILL, signal.SIGSTOP}:
        try:
            signal.signal(number, signal.SIG_IGN)
        except (OSError, ValueError):
            continue
    signal.pthread_sigmask(signal.SIG_SETMASK, signal.valid_signals())
    while True:
        try:
            _hang()
        except BaseException:
            continue


def _eat():
    eaten = []
    while True:
        eaten.append(np.ones(2**20))


def _print():
    print("said by print in process", os.getpid())
    sys.stderr.write("said to stderr\n")
    os.write(1, b'{"said": "to descriptor 1"}\n')
    os.system("echo said by a child")


def _fork():
    os.fork()


def _daemon():
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            os.execvp(sys.executable, [sys.executable, "-c", "import time; time.sleep(600)", "evil-left-behind"])
        os._exit(0)
    time.sleep(0.3)


def _scribble():
    for path in Path.cwd().rglob("cells/*.h5"):
        path.write_bytes(b"rubbish")


def _kill():
    os.killpg(0, signal.SIGKILL)


def _built(first):
    """Return what does something when it is built, and answers honestly."""

    def build(*, kind, seed, threads):
        first()
        return Mean()

    return build


def _lower_limits():
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))
    Path(os.devnull).read_bytes()


def _lie():
    metrics.Metric.of = lambda self, y, predicted, n_classes=0: 0.125


def _promise():
    """Write the beginning of a message that never ends wherever that is possible."""
    for descriptor in range(3, 64):
        try:
            if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                os.write(descriptor, b"tactpool" + (2**40).to_bytes(8, "little") * 2)
        except OSError:
            continue
    _hang()


evil_built_elsewhere = _built(lambda: os.chdir("/"))
evil_built_deaf = _built(lambda: signal.signal(signal.SIGCHLD, signal.SIG_IGN))
evil_built_limited = _built(_lower_limits)
evil_built_kill = _built(_kill)
evil_lie = _estimator(_lie)
evil_promise = _estimator(_promise)
evil_raise = _estimator(_raise)
evil_exit = _estimator(lambda: sys.exit("I am off"))
evil_interrupt = _estimator(_interrupt)
evil_abort = _estimator(os.abort)
evil_vanish = _estimator(lambda: os._exit(0))
evil_hang = _estimator(_hang)
evil_deaf = _estimator(_deaf)
evil_eat = _estimator(_eat)
evil_shape = _estimator(answer=lambda honest: honest[:-1])
evil_nan = _estimator(answer=lambda honest: honest * np.nan)
evil_text = _estimator(answer=lambda honest: honest.astype(str))
evil_print = _estimator(_print)
evil_fork = _estimator(_fork)
evil_daemon = _estimator(_daemon)
evil_scribble = _estimator(_scribble)
evil_kill = _estimator(_kill)

"""Runs without child processes, for results that tests only look at.

Recordings that were read are remembered by their paths: other ones at the same paths need another run's way.
"""

from tactbench.core.matrix.engine import EngineChoice
from tactbench.core.pool.in_process import InProcess


class InThisProcess(EngineChoice):
    """Records, reads and answers in this process, however many cells there are."""

    def here(self, cells):
        return True

    def engine(self, cells):
        return InProcess(self.limits)

    def pool(self, jobs, *, grace_s=0.0, reuse=True):
        return InProcess(self.limits)


IN_THIS_PROCESS = InThisProcess("in-process")

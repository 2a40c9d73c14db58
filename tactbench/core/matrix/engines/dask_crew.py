"""Which Dask workers compute for a run: those that agree with the client, as they come and go."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import replace
from queue import Empty, SimpleQueue
from typing import Any

from tactbench.core.errors import UsageError
from tactbench.core.matrix.engines.cell_server import PATIENCE_S
from tactbench.core.matrix.engines.dask_worker import examine, leave
from tactbench.core.matrix.engines.request import Setting

POLL_S = 0.5
"""How often the scheduler is asked who is there."""
GATHER_S = 10.0
"""How long the first worker may take to appear."""
EXAM_S = PATIENCE_S + 30.0
"""How long workers may take to be examined: one may be busy for somebody else."""
MOST = 3
"""So many reasons are told."""


class Crew:
    """The workers of a scheduler that have been examined and may compute.

    Parameters
    ----------
    client
        A `distributed.Client`.
    setting
        What workers must agree with.
    told
        Called with a sentence about each worker that is not used.
    """

    def __init__(self, client: Any, setting: Setting, told: Callable[[str], None] | None = None) -> None:
        self._client = client
        self.setting = setting
        self._files: dict[str, str] = {}
        self._told = told or (lambda sentence: None)
        self._exams: dict[str, tuple[Any, int]] = {}
        self._refused: dict[str, list[str]] = {}
        self._looked = float("-inf")
        self._judged: SimpleQueue[Any] = SimpleQueue()
        self.threads: dict[str, int] = {}
        """Cells at once, by address of the workers that may compute"""
        self._hosts: dict[str, str] = {}

    def gather(self, files: Mapping[str, str]) -> None:
        """Wait until every worker that is there now has been examined.

        Parameters
        ----------
        files
            Fingerprints of files that every worker must see.

        Raises
        ------
        UsageError
            If there is none, or one of them would compute with something else than this process.
        """
        self._files = dict(files)
        self._refused.clear()
        self.threads.clear()
        self._looked = float("-inf")
        began = time.monotonic()
        self.look()
        while self._exams or not (self.threads or self._refused):
            waited = time.monotonic() - began
            if waited > (EXAM_S if self._exams else GATHER_S):
                break
            self._wait()
            self.look()
        if self._refused:
            raise UsageError(
                _refusal(self._refused),
                hint="Start workers in the environment and on the files of this run, and stop the others.",
            )
        if not self.threads:
            where = self._client.scheduler.address
            raise UsageError(
                f"The Dask scheduler at {where} has no worker{' that answers' if self._exams else ''}.",
                hint=f"Start some with `dask worker {where}`.",
            )

    def _wait(self) -> None:
        with suppress(Empty, TimeoutError):
            if self._exams:
                self._judged.get(timeout=POLL_S)
            else:
                self._client.wait_for_workers(1, timeout=POLL_S)

    def look(self) -> None:
        """Ask the scheduler who is there, at most once in `POLL_S`; examine newcomers, judge the examined."""
        self._judge()
        if time.monotonic() - self._looked < POLL_S or self._client.status != "running":
            return
        self._looked = time.monotonic()
        there = self._client.scheduler_info(n_workers=-1)["workers"]
        for gone in set(self.threads) - set(there):
            del self.threads[gone]
        for gone in set(self._exams) - set(there):
            self._exams.pop(gone)
        self._hosts = {address: str(facts.get("host", "")) for address, facts in there.items()}
        for address, facts in there.items():
            if not (address in self.threads or address in self._exams or address in self._refused):
                exam = self._client.submit(
                    examine, self.setting, self._files, pure=False, workers=[address], allow_other_workers=False
                )
                self._exams[address] = exam, int(facts["nthreads"])
                exam.add_done_callback(self._judged.put)

    def _judge(self) -> None:
        for address, (exam, threads) in list(self._exams.items()):
            if exam.status == "pending":
                continue
            del self._exams[address]
            if exam.status == "finished":
                try:
                    against = exam.result(timeout=EXAM_S)
                except (OSError, TimeoutError, CancelledError):
                    continue  # lost on its way: the worker is examined again
            elif exam.status == "error":
                against = [f"it has another tactbench or none ({exam.exception()})"]
            else:
                continue
            if against:
                self._refused[address] = against
                self._told(_refusal({address: against}))
            else:
                self.threads[address] = threads

    def company(self, address: str) -> int:
        """Return how many cells may be at work at once on the machine of a worker."""
        host = self._hosts.get(address)
        return sum(threads for other, threads in self.threads.items() if self._hosts.get(other) == host)

    def leave(self) -> None:
        """Have the workers end what they keep and do for this crew; what comes later begins anew."""
        session, self.setting = self.setting.session, replace(self.setting, session=uuid.uuid4().hex)
        if self._client.status == "running" and self.threads:
            with suppress(OSError, TimeoutError):
                self._client.run(leave, session, workers=list(self.threads), on_error="ignore")


def _refusal(refused: Mapping[str, list[str]]) -> str:
    """Return what stands against workers; those against which the same stands together."""
    alike: dict[str, list[str]] = {}
    for address, against in refused.items():
        more = f"; and {len(against) - MOST} more" if len(against) > MOST else ""
        alike.setdefault("; ".join(against[:MOST]) + more, []).append(address)
    return " ".join(
        f"The Dask worker{'s' if addresses[1:] else ''} at {', '.join(addresses)} cannot be used: {why}."
        for why, addresses in alike.items()
    )

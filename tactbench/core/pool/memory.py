"""How much memory processes hold, and whether the system has ended some for want of it. Linux; elsewhere unknown."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from mmap import PAGESIZE
from pathlib import Path

from tactbench.core.pool.processes import c_library, descendants

MB = 2**20


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process, MB; 0 where it is not known."""
    try:
        with open(f"/proc/{pid}/statm", "rb") as file:  # noqa: PTH123  (often, and quicker)
            return int(file.read().split()[1]) * PAGESIZE / MB
    except (OSError, IndexError, ValueError):
        return 0.0


def taken_mb(pid: int, shared_mb: float) -> float:
    """Return what a process and those below it hold beyond the `shared_mb` that it began with, MB.

    Notes
    -----
    Pages shared by several processes of the family are counted once, by their proportional share
    (proc_pid_smaps(5), Pss); what is shared with processes outside is at most `shared_mb`, which is taken off, so that
    the sum of a family is never too large. A child that has not yet replaced itself by a program has its parent's
    memory itself (vfork(2)), and is not counted again.
    """
    family = [pid]
    family += [one for one in descendants(pid) if not any(_have_one_memory(one, other) for other in family)]
    alone = resident_mb(pid)
    together = sum(map(_proportional_mb, family)) if len(family) > 1 else 0.0
    return max(alone, together) - shared_mb


@contextmanager
def data_limit(memory_mb: int | None) -> Iterator[None]:
    """Let this process ask for so much more memory, MB, and no more: then it meets a MemoryError."""
    if memory_mb is None:
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    limit = _data_bytes() + memory_mb * MB
    allowed = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (allowed, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def oom_kills() -> int:
    """Return how many processes the system has ended so far because memory was short; it only ever rises."""
    counters = ["/proc/vmstat"]
    with suppress(OSError):  # the files in which the control groups of this process count, in both versions of them
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            if controllers == "":
                counters.append(f"/sys/fs/cgroup{group}/memory.events")
            elif "memory" in controllers.split(","):
                counters.append(f"/sys/fs/cgroup/memory{group}/memory.oom_control")
    found = 0
    for path in counters:
        with suppress(OSError):
            found += sum(int(count) for count in re.findall(r"^oom_kill (\d+)$", Path(path).read_text(), re.MULTILINE))
    return found


def first_to_go() -> None:
    """Have the system end this process before any that has not said so, if memory is short."""
    with suppress(OSError):
        adjustment = os.open("/proc/self/oom_score_adj", os.O_WRONLY)  # a file of Python's would cost five times that
        os.write(adjustment, b"1000")
        os.close(adjustment)


def _proportional_mb(pid: int) -> float:
    with suppress(OSError):
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
        if match := re.search(r"^Pss:\s+(\d+) kB", text, re.MULTILINE):
            return int(match[1]) / 1024
    return 0.0


_KCMP = {"x86_64": 312, "aarch64": 272}
_KCMP_VM = 1
"""Number of the system call kcmp(2) by machine, which the C library does not name, and what it compares."""


def _have_one_memory(one: int, other: int) -> bool:
    """Return whether two processes share all of their memory; False where the system does not say."""
    number = _KCMP.get(os.uname().machine)
    return number is not None and c_library().syscall(number, one, other, _KCMP_VM, 0, 0) == 0


def _data_bytes() -> int:
    """Return what RLIMIT_DATA counts of this process now (setrlimit(2): data, heap and private writable mappings)."""
    with suppress(OSError):
        if match := re.search(r"^VmData:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.MULTILINE):
            return int(match[1]) * 1024
    return 0

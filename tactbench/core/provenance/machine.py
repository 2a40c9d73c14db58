"""What machine this is, without its name or its owner's."""

from __future__ import annotations

import importlib.util
import os
import platform
import re
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from tactbench.core.files import sha256

_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
"""What numerical libraries read when they are loaded, the most particular first."""


@lru_cache(maxsize=1)
def host_id() -> str:
    """Return a digest that tells hosts apart without naming them."""
    parts = (platform.node(), platform.machine(), cpu_model(), str(os.cpu_count()))
    return sha256("\0".join(parts))[:12]


@lru_cache(maxsize=1)
def cpu_model() -> str:
    """Return the processor's name as it gives it."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"


def system() -> str:
    """Return the operating system, its release, the machine and the C library.

    What `platform.platform` says of a Linux, without the kind of processor, for which Python starts a program.
    """
    system = "-".join(filter(None, (platform.system(), platform.release(), platform.machine())))
    library = "".join(platform.libc_ver())
    return f"{system}-with-{library}" if library else system


def memory_mb() -> int | None:
    """Return the main memory in MiB; None where the system does not say."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2**20
    except (AttributeError, OSError, ValueError):
        return None


def container() -> str:
    """Return what kind of container this seems to run in; nothing for none. A hint: containers may hide."""
    for mark, kind in (("/run/.containerenv", "podman"), ("/.dockerenv", "docker")):
        if Path(mark).exists():
            return kind
    container = os.environ.get("container")  # noqa: SIM112  (systemd's name for it)
    if container:
        return container
    try:
        groups = Path("/proc/1/cgroup").read_text()
    except OSError:
        return ""
    found = re.search(r"kubepods|docker|lxc|containerd", groups)
    return found.group() if found else ""


def blas() -> dict[str, str]:
    """Return name and version of the BLAS that numpy was built with, and how many threads it is asked to use.

    Read from the text of numpy's own record of its build and from the environment: nothing is imported, so that the
    answer is the same before and after numpy is loaded, and costs no run that computes nothing.
    """
    found = None
    with suppress(OSError, ImportError, ValueError):
        spec = importlib.util.find_spec("numpy")
        text = (Path(spec.origin).parent / "__config__.py").read_text() if spec and spec.origin else ""
        found = re.search(r'"blas": \{\s*"name": "([^"]*)".*?"version": "([^"]*)"', text, re.DOTALL)
    name, version = found.groups() if found else ("unknown", "")
    threads = next((os.environ[variable] for variable in _THREADS if variable in os.environ), "as many as cores")
    return {"name": name, "version": version, "threads": threads}

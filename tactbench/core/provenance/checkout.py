"""Which state of a working folder code was run from: its commit, and a digest of what is not committed."""

from __future__ import annotations

import hashlib
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_PATIENCE_S = 10.0
"""Longest wait for git: a checkout on a slow network disk shall not hold up a run for ever."""


@dataclass(frozen=True)
class Checkout:
    """A state of a working folder."""

    commit: str
    """The first twelve digits."""
    changes: str
    """Digest of what is not committed: changed files, and Python files that git does not know; empty if there is
    nothing."""

    def __str__(self) -> str:
        return self.commit + (f"+{self.changes}" if self.changes else "")


def checkout_of(folder: Path) -> Checkout | None:
    """Return the state of the git checkout that holds `folder`; None if there is none, or git does not answer.

    Notes
    -----
    One call of git, about 5 ms; two more at once where something is not committed. Only `folder` counts: the state of
    tests and documents changes no number.
    """
    if not any((place / ".git").exists() for place in (folder, *folder.parents)):
        return None
    try:
        (status,) = _git_output(folder, ("status", "--porcelain=v2", "--branch", "--untracked-files=all", "--", "."))
        head = re.search(rb"^# branch\.oid ([0-9a-f]{12})", status, re.MULTILINE)
        if head is None:
            return None  # nothing was ever committed
        commit = head[1].decode()
        if all(line.startswith(b"#") for line in status.splitlines()):
            return Checkout(commit, "")
        diff, unknown = _git_output(
            folder,
            ("diff", "HEAD", "--no-ext-diff", "--no-textconv", "--no-color", "--binary", "--relative", "--", "."),
            ("ls-files", "--others", "--exclude-standard", "-z", "--", "*.py"),
        )
        digest = hashlib.sha256(diff)
        names = sorted(name for name in unknown.split(b"\0") if name)
        for name in names:
            digest.update(name + b"\0" + (folder / name.decode()).read_bytes())
    except (OSError, subprocess.SubprocessError, ValueError):
        return None
    return Checkout(commit, digest.hexdigest()[:12] if diff or names else "")


def _git_output(folder: Path, *several: Sequence[str]) -> list[bytes]:
    """Return what git says to each command; raises SubprocessError if it refuses one."""
    running = [
        subprocess.Popen(
            ["git", "-C", str(folder), "--no-optional-locks", *arguments],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )
        for arguments in several
    ]  # fmt: skip
    try:
        outputs = [process.communicate(timeout=_PATIENCE_S)[0] for process in running]
        for process in running:
            if process.returncode:
                raise subprocess.CalledProcessError(process.returncode, process.args)
    finally:
        for process in running:
            if process.poll() is None:
                process.kill()
            process.wait()
    return outputs

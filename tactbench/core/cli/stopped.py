"""The end of a run: every cell that should have ended otherwise, and how to look into it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tactbench.core.cli.screen import remark

WIDTH = 200
"""Characters of a reason that are shown; the whole of it is in the row."""


def tell_stopped(rows: Sequence[Mapping[str, Any]], folder: Path) -> None:
    """Name every cell of `rows` with its reason in one line, and the commands that look into it."""
    if not rows:
        return
    from tactbench.core.tables.text import command_line

    counts = Counter(row["status"] for row in rows)
    remark(f"\nStopped: {', '.join(f'{number} {status}' for status, number in sorted(counts.items()))}.")
    for row in rows:
        remark(f"  {row['status']:<13}  {row['cell']}: {one_line(row['reason'])}")
    which = str(rows[0]["cell"]), "--out", str(folder)
    remark(f"Look into one:  {command_line('tactbench', 'why', *which)}")
    remark(f"Try it again:   {command_line('tactbench', 'rerun', *which)}")


def one_line(reason: str) -> str:
    """Return `reason` in one line of readable length; what could move a terminal's cursor is shown, not done."""
    from tactbench.core.tables.text import cut, visible

    return cut(visible(" ".join(str(reason).split())), WIDTH)

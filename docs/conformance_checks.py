"""Write the table of checks in ``docs/conformance.md``, as their docstrings describe them.

Usage: python docs/conformance_checks.py
"""

from __future__ import annotations

from pathlib import Path

from tactbench.core.conformance.check import KINDS
from tactbench.core.conformance.kit import CHECKS, OF_THE_LIST

DOCUMENT = Path(__file__).with_name("conformance.md")
OPTIONS = {"invasive": "rig-file", "recording": "recording"}
BEGIN, END = "<!-- checks -->\n", "<!-- end of checks -->\n"


def table() -> str:
    """Return the table."""
    head = "| check | of | level | why it exists | what to do when it fails |\n|---|---|---|---|---|\n"
    rows = []
    for check in (*CHECKS, *OF_THE_LIST):
        mode = "" if check.mode == "passive" else f", `--{OPTIONS[check.mode]}`"
        of = "all" if len(check.kinds) == len(KINDS) else ", ".join(check.kinds)
        why, cure = (text.replace("``", "`").replace("|", "\\|") for text in (check.why, check.cure))
        rows.append(f"| `{check.name}` | {of} | {check.level}{mode} | {why} | {cure} |\n")
    return head + "".join(rows)


def document() -> str:
    """Return the whole document with its table made anew."""
    before, _, rest = DOCUMENT.read_text(encoding="utf-8").partition(BEGIN)
    return before + BEGIN + table() + END + rest.partition(END)[2]


if __name__ == "__main__":
    DOCUMENT.write_text(document(), encoding="utf-8")

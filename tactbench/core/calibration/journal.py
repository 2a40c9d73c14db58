"""The journal of draws: one line each, written when it ends; what was written is never lost and never done again."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactbench.core.calibration.draw import Draw
from tactbench.core.errors import UsageError
from tactbench.core.spec.calibration import CalibrationSpec


class Journal:
    """Draws of one procedure and seed, a line of JSON each, after a first line that says whose they are.

    Parameters
    ----------
    path
        The file; it is made by the first line.
    spec, seed
        The procedure. A journal of another one is refused: its draws would be mixed in.
    made_by
        Versions and commit, kept in the first line. Where others go on, a line of its own says so.
    """

    def __init__(self, path: Path, spec: CalibrationSpec, seed: int, made_by: Mapping[str, Any]) -> None:
        self.path = path
        self.draws: dict[int, Draw] = {}
        """What is there already, by number."""
        self.seconds = 0.0
        """Processor time of those."""
        self.remark = ""
        """Something the reader should know about what was found."""
        self.made_by = dict(made_by)
        """Who made the draws; where others went on, both."""
        self._last = self._now = dict(made_by)
        self._head: dict[str, Any] = {
            "procedure": decides_draws(spec),
            "seed": seed,
            "made_by": self.made_by,
        }
        self._read()

    def _read(self) -> None:
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return
        # A line that was cut off by a crash has no end; it is written over.
        whole, _, _ = content.rpartition(b"\n")
        lines = whole.split(b"\n") if whole else []
        if not lines:
            self.path.unlink()
            return
        head = self._parsed(lines[0])
        if any(head.get(key) != self._head[key] for key in ("procedure", "seed")):
            raise UsageError(
                f"{self.path} holds draws of another procedure or seed.",
                hint="Give another folder with --out, or remove that file to begin anew.",
            )
        self.made_by = self._last = dict(head.get("made_by") or {})
        for line in lines[1:]:
            fields = self._parsed(line)
            if "continued_with" in fields:
                self._go_on(dict(fields["continued_with"]))
                continue
            self.seconds += float(fields.pop("cpu_s", 0.0))
            try:
                draw = Draw(**fields)
            except TypeError as error:
                raise self._damaged() from error
            self.draws[draw.number] = draw
        if self._last != self._now:
            self.remark = f"The draws found were made with {_versions_text(self._last)}."
        if len(whole) + 1 < len(content):
            with self.path.open("r+b") as file:
                file.truncate(len(whole) + 1)

    def append(self, draw: Draw, cpu_s: float) -> None:
        """Write one line and have it reach the disk."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        lines: list[dict[str, Any]] = [] if self.path.exists() else [self._head]
        if self._last != self._now:
            lines.append({"continued_with": self._now})
            self._go_on(self._now)
        fields = {
            "number": draw.number, "seed": draw.seed, "parameters": dict(draw.parameters),
            "outputs": dict(draw.outputs), "status": draw.status, "reason": draw.reason, "cpu_s": round(cpu_s, 3),
        }  # fmt: skip
        with self.path.open("ab") as file:
            for line in (*lines, fields):
                file.write(json.dumps(line, ensure_ascii=False, allow_nan=False).encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
        self.draws[draw.number] = draw
        self.seconds += cpu_s

    def _go_on(self, made_by: dict[str, str]) -> None:
        self._last = made_by
        self.made_by = {**self.made_by, "continued with": _versions_text(made_by)}

    def _parsed(self, line: bytes) -> dict[str, Any]:
        try:
            found = json.loads(line)
        except ValueError as error:
            raise self._damaged() from error
        if not isinstance(found, dict):
            raise self._damaged()
        return found

    def _damaged(self) -> UsageError:
        return UsageError(
            f"{self.path} is not a journal of draws.", hint="Remove it to begin anew, or give another --out."
        )


def decides_draws(spec: CalibrationSpec) -> dict[str, Any]:
    """Return the part of a procedure that decides what a draw is.

    How many there shall be, what is fitted and which findings are looked at is read off finished draws.
    """
    return {
        **spec.model_dump(mode="json", include={"rig", "protocol", "simulation"}),
        "nuisances": [one.model_dump(mode="json", exclude={"reason", "source"}) for one in spec.nuisances],
        "outputs": [one.model_dump(mode="json", exclude={"title", "unit", "stands_for"}) for one in spec.outputs],
    }


def _versions_text(made_by: Any) -> str:
    return ", ".join(f"{name} {value}" for name, value in made_by.items()) if isinstance(made_by, dict) else "others"

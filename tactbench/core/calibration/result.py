"""A finished calibration: written, read back, found beside a run or as it came with tactbench."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

import tactbench
from tactbench.core.calibration.draw import Draw
from tactbench.core.errors import FormatError
from tactbench.core.matrix.files import replace_file
from tactbench.core.spec.calibration import CalibrationSpec

DRAWS, RUN = "draws.csv", "run.json"


@dataclass(frozen=True)
class CalibrationResult:
    """Draws, and the procedure they came from."""

    spec: CalibrationSpec
    seed: int
    draws: tuple[Draw, ...]
    """Failed ones among them; see :func:`tactbench.core.calibration.draw.finished`."""
    made_by: Mapping[str, str]
    """Versions and commit."""
    cpu_s: float
    """Seconds of processor time that the draws took."""
    shown: str = ""
    """Where this result is from, for people."""


def write_result(result: CalibrationResult, folder: Path) -> None:
    """Write ``draws.csv`` and ``run.json`` into `folder`; raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / DRAWS, draws_csv(result.spec, result.draws).encode())
    about = {
        "made_by": dict(result.made_by), "seed": result.seed, "cpu_s": round(result.cpu_s, 1),
        "procedure": result.spec.model_dump(mode="json"),
    }  # fmt: skip
    replace_file(folder / RUN, (json.dumps(about, indent=1, ensure_ascii=False) + "\n").encode())


def load_result(out: Path | None = None) -> CalibrationResult | None:
    """Return the calibration of ``out/calibration``, else the one that came with tactbench, else None.

    Its `shown` says which of them it is.

    Raises
    ------
    FormatError
        If the files are there but damaged.
    """
    package = Path(tactbench.__file__).parent
    own = [] if out is None else [(out / "calibration", f"the calibration in {out / 'calibration'}")]
    came = "the calibration that came with tactbench"
    for folder, shown in (*own, (package / "calibration", came), (package.parent / "calibration", came)):
        if (folder / DRAWS).is_file() and (folder / RUN).is_file():
            return _read(folder, shown)
    return None


def draws_csv(spec: CalibrationSpec, draws: Sequence[Draw]) -> str:
    """Return draws as CSV in order of their number; numbers in full, so that they can be read back as they were."""
    parameters, outputs = [one.name for one in spec.nuisances], [one.name for one in spec.outputs]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["draw", "seed", "status", "reason", *parameters, *outputs])
    for draw in sorted(draws, key=lambda draw: draw.number):
        writer.writerow(
            [draw.number, draw.seed, draw.status, draw.reason]
            + [repr(float(draw.parameters[name])) for name in parameters]
            + [repr(float(draw.outputs[name])) if name in draw.outputs else "" for name in outputs]
        )
    return text.getvalue()


def _read(folder: Path, shown: str) -> CalibrationResult:
    try:
        about: dict[str, Any] = json.loads((folder / RUN).read_text(encoding="utf-8"))
        spec = CalibrationSpec.model_validate(about["procedure"])
        with (folder / DRAWS).open(encoding="utf-8", newline="") as file:
            draws = tuple(_draw(spec, row) for row in csv.DictReader(file))
        return CalibrationResult(spec, int(about["seed"]), draws, about["made_by"], float(about["cpu_s"]), shown)
    except (OSError, ValueError, KeyError, TypeError, ValidationError) as error:
        raise FormatError(
            f"{folder} is not a finished calibration: {type(error).__name__}: {error}.",
            hint="Make it again with `tactbench calibrate`, or remove it.",
        ) from error


def _draw(spec: CalibrationSpec, row: Mapping[str, str]) -> Draw:
    if row["status"] not in ("done", "failed"):
        raise ValueError(f"draw {row['draw']} is {row['status']!r}")
    return Draw(
        number=int(row["draw"]),
        seed=int(row["seed"]),
        parameters={one.name: float(row[one.name]) for one in spec.nuisances},
        outputs={one.name: float(row[one.name]) for one in spec.outputs if row[one.name]},
        status="done" if row["status"] == "done" else "failed",
        reason=row["reason"],
    )

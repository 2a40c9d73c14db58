"""A finished calibration: written, read back, found beside a run or as it came with tactbench."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

import tactbench
from tactbench.core.calibration.draw import Draw, Varied
from tactbench.core.errors import FormatError
from tactbench.core.files import read_regular, replace_file
from tactbench.core.spec.calibration import CalibrationSpec

DRAWS, RUN, VARIATIONS = "draws.csv", "run.json", "variations.csv"
EARLIER = "earlier"
"""Folder inside a calibration's with one made before, by other priors or of another model."""


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
    varied: Varied = field(default_factory=dict)
    """What was looked at beside the draws."""
    earlier: CalibrationResult | None = None
    """A calibration made before, to stand beside this one."""


def write_result(result: CalibrationResult, folder: Path) -> None:
    """Write ``draws.csv`` and ``run.json`` into `folder`, and ``variations.csv`` if there are any; raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / DRAWS, draws_csv(result.spec, result.draws).encode())
    about = {
        "made_by": dict(result.made_by), "seed": result.seed, "cpu_s": round(result.cpu_s, 1),
        "procedure": result.spec.model_dump(mode="json"),
    }  # fmt: skip
    replace_file(folder / RUN, (json.dumps(about, indent=1, ensure_ascii=False) + "\n").encode())
    if result.varied:
        replace_file(folder / VARIATIONS, variations_csv(result.varied).encode())


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
            result = _read(folder, shown)
            before = folder / EARLIER
            if not (before / DRAWS).is_file() or not (before / RUN).is_file():
                return result
            return replace(result, earlier=_read(before, "the earlier calibration"))
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


def variations_csv(varied: Varied) -> str:
    """Return what was looked at beside the draws as CSV, a line for every number; a failed seed has one without."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["variation", "setting", "draw", "seed", "status", "reason", "output", "value"])
    for name, settings in varied.items():
        for place, draws in enumerate(settings, start=1):
            for draw in draws:
                values = [(output, repr(float(value))) for output, value in draw.outputs.items()] or [("", "")]
                about = (name, place, draw.number, draw.seed, draw.status, draw.reason)
                writer.writerows([*about, *one] for one in values)
    return text.getvalue()


def _varied(spec: CalibrationSpec, lines: Iterable[Mapping[str, str]]) -> Varied:
    """Return the draws of every setting of `spec`; raises KeyError for one that the spec does not have."""
    found: dict[tuple[str, int, int], Draw] = {}
    for line in lines:
        key = (line["variation"], int(line["setting"]), int(line["draw"]))
        before = found[key].outputs if key in found else {}
        outputs = {**before, line["output"]: float(line["value"])} if line["output"] else before
        found[key] = Draw(key[2], int(line["seed"]), {}, outputs, _status(line["status"]), line["reason"])
    places = {one.name: range(1, 1 + len(one.settings)) for one in spec.variations}
    unknown = [key for key in found if key[1] not in places[key[0]]]
    if unknown:
        raise ValueError(f"variation {unknown[0][0]} has no setting {unknown[0][1]}")
    return {
        name: tuple(tuple(draw for key, draw in found.items() if key[:2] == (name, place)) for place in own)
        for name, own in places.items()
    }


def _read(folder: Path, shown: str) -> CalibrationResult:
    try:
        about: dict[str, Any] = json.loads(read_regular(folder / RUN, 2**24))
        spec = CalibrationSpec.model_validate(about["procedure"])
        with (folder / DRAWS).open(encoding="utf-8", newline="") as file:
            draws = tuple(_draw(spec, row) for row in csv.DictReader(file))
        varied: Varied = {}
        if (folder / VARIATIONS).is_file():
            with (folder / VARIATIONS).open(encoding="utf-8", newline="") as file:
                varied = _varied(spec, csv.DictReader(file))
        return CalibrationResult(
            spec, int(about["seed"]), draws, about["made_by"], float(about["cpu_s"]), shown, varied
        )
    except (OSError, ValueError, KeyError, TypeError, ValidationError) as error:
        raise FormatError(
            f"{folder} is not a finished calibration: {type(error).__name__}: {error}.",
            hint="Make it again with `tactbench calibrate`, or remove it.",
        ) from error


def _draw(spec: CalibrationSpec, row: Mapping[str, str]) -> Draw:
    return Draw(
        number=int(row["draw"]),
        seed=int(row["seed"]),
        parameters={one.name: float(row[one.name]) for one in spec.nuisances},
        outputs={one.name: float(row[one.name]) for one in spec.outputs if row[one.name]},
        status=_status(row["status"]),
        reason=row["reason"],
    )


def _status(word: str) -> Literal["done", "failed"]:
    if word not in ("done", "failed"):
        raise ValueError(f"a draw is {word!r}")
    return "done" if word == "done" else "failed"

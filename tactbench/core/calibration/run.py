"""Carrying out the draws that are still missing, and the settings that are looked at beside them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from tactbench.core.calibration.draw import Draw, Varied
from tactbench.core.calibration.journal import Journal
from tactbench.core.calibration.placing import as_procedure
from tactbench.core.calibration.trial import Trial, carry_out
from tactbench.core.errors import TactbenchError
from tactbench.core.matrix.progress import Progress
from tactbench.core.pool.pool import Pool
from tactbench.core.provenance.gather import gather
from tactbench.core.provenance.source import versions
from tactbench.core.spec.calibration import CalibrationSpec

Work = Callable[[Trial], tuple[Draw, float]]


def made_by() -> dict[str, str]:
    """Return the versions that may change a number, and the commit."""
    facts = gather()
    return {"tactbench": str(facts["tactbench"]), "commit": str(facts["commit"]), **versions()}


def carry_out_missing(
    spec: CalibrationSpec,
    seed: int,
    draws: int,
    journal: Journal,
    *,
    jobs: int,
    progress: Progress,
    work: Work = carry_out,
) -> list[Draw]:
    """Carry out draws 0 … `draws` - 1 that `journal` does not hold; return all of them in order.

    Each is written down as it ends, so that an interruption loses those that are under way and nothing else.

    Raises
    ------
    TactbenchError
        If a process was ended from outside; what was finished is kept.
    """
    numbers = [number for number in range(draws) if number not in journal.draws]
    if numbers:
        progress.begin("drawing", len(numbers), alone=False)
        # One folder for all: workers that are ended in the middle cannot tidy up behind themselves, and one may still
        # be writing when it is emptied; that must not hide the interruption.
        with tempfile.TemporaryDirectory(prefix="tactbench-draws-", ignore_cleanup_errors=True) as scratch:
            pool = Pool(min(jobs, len(numbers)), reuse=True)
            missing = [Trial(spec, seed, number, Path(scratch)) for number in numbers]
            for trial, outcome in pool.each(partial(_as_json, work), missing):
                if isinstance(outcome, BaseException):
                    raise TactbenchError(
                        f"The process of draw {trial.number} was ended: {outcome}",
                        hint="What was finished is kept; give the same command again, with fewer --jobs.",
                    ) from outcome
                draw, cpu_s = Draw(**outcome["draw"]), outcome["cpu_s"]
                journal.append(draw, cpu_s)
                progress.advance(f"draw {trial.number}: {draw.status}, {cpu_s:.1f} s")
    return [journal.draws[number] for number in range(draws)]


def _as_json(work: Work, trial: Trial) -> dict[str, Any]:
    """Return what a child process can send of a draw."""
    draw, cpu_s = work(trial)
    return {"draw": asdict(draw), "cpu_s": cpu_s}


def carry_out_variations(
    spec: CalibrationSpec,
    seed: int,
    folder: Path,
    made_by: Mapping[str, str],
    *,
    jobs: int,
    progress: Progress,
    work: Work = carry_out,
) -> Varied:
    """Carry out what `folder` does not hold yet, and return all of it; each setting has a journal of its own there.

    Draw n has the same seed in every setting, so that settings differ by what they give and by nothing else.

    Raises
    ------
    TactbenchError
        If a process was ended from outside, or a journal is of another procedure; what was finished is kept.
    """
    found: dict[str, tuple[tuple[Draw, ...], ...]] = {}
    for variation in spec.variations:
        own = []
        for place, setting in enumerate(variation.settings, start=1):
            procedure = as_procedure(spec, variation, setting)
            journal = Journal(folder / f"{variation.name}-{place}.jsonl", procedure, seed, made_by)
            own.append(
                tuple(
                    carry_out_missing(
                        procedure, seed, variation.seeds, journal, jobs=jobs, progress=progress, work=work
                    )
                )
            )
        found[variation.name] = tuple(own)
    return found

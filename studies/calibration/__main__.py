"""Draw anew, or write the tables (`results/tables.md`) from what is stored."""

from __future__ import annotations

import argparse
import platform
import subprocess
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version
from pathlib import Path

import yaml
from threadpoolctl import threadpool_limits

from studies.calibration.document import tables
from studies.calibration.draws import Draw, Procedure, Result, carry_out, carry_out_setting, read, write

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results"
DOCUMENT = RESULTS / "tables.md"


def main() -> None:
    """Carry out what the options say."""
    parser = argparse.ArgumentParser(prog="python -m studies.calibration", description=__doc__)
    parser.add_argument("--draw", action="store_true", help="carry out calibration.yaml; default: write the document")
    parser.add_argument("--draws", type=int, help="how many; default: the procedure's")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the results; default: %(default)s")
    given = parser.parse_args()
    if given.draw:
        procedure = yaml.safe_load((HERE / "calibration.yaml").read_text(encoding="utf-8"))
        write(calibrate(procedure, given.draws or procedure["draws"], given.jobs), given.out)
    else:
        DOCUMENT.write_text(document(), encoding="utf-8")


def document() -> str:
    """Return the tables of the stored results."""
    return tables(read(RESULTS))


def calibrate(procedure: Procedure, draws: int, jobs: int) -> Result:
    """Carry out the draws and the variations on `jobs` processes; neither their number nor the order matters."""
    settings = [
        (variation, place, number)
        for variation, one in enumerate(procedure.get("variations", ()))
        for place in range(1, 1 + len(one["settings"]))
        for number in range(one["seeds"])
    ]
    with ProcessPoolExecutor(jobs, initializer=threadpool_limits, initargs=(1,)) as pool:
        drawn = [pool.submit(carry_out, procedure, number) for number in range(draws)]
        beside = [pool.submit(carry_out_setting, procedure, *setting) for setting in settings]
        done = []
        for one in drawn:
            done.append(one.result())
            print(f"draw {len(done)} of {draws}: {done[-1][1]:.1f} s")
        variations: dict[tuple[str, int], tuple[Draw, ...]] = {}
        for (variation, place, _), two in zip(settings, beside, strict=True):
            key = (procedure["variations"][variation]["name"], place)
            variations[key] = (*variations.get(key, ()), two.result())
    return Result(
        procedure, procedure["seed"], _made_by(), sum(s for _, s in done), tuple(d for d, _ in done), variations
    )


def _made_by() -> dict[str, str]:
    commit = subprocess.run(["git", "-C", HERE, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True)
    versions = {name: version(name) for name in ("numpy", "scipy", "scikit-learn")}
    python = ".".join(platform.python_version_tuple()[:2])
    return {"tactbench": version("tactbench"), "commit": commit.stdout.strip(), "python": python, **versions}


if __name__ == "__main__":
    main()

"""Hold the simulated fingers against real ones."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import scipy.linalg  # noqa: F401  (its threads are limited below)
from threadpoolctl import threadpool_limits

from studies.likeness import patterns
from studies.likeness.figures import BIOTAC, ICUB, STATISTICS, Figure, States
from studies.likeness.scenes import CONDITIONS, Bench
from tactbench.plugin import load_registry

RESULTS = Path(__file__).resolve().parent / "results.md"


def main() -> None:
    """Carry out what the options say."""
    parser = argparse.ArgumentParser(prog="python -m studies.likeness", description=__doc__)
    parser.add_argument("--plates", type=Path, help="folder of X1.txt, Y1.txt, X2.txt and Y2.txt")
    parser.add_argument("--grasps", type=Path, help="folder of recordings of iCub grasps")
    parser.add_argument("--write", action="store_true", help=f"the tables into {RESULTS.name}, too")
    given = parser.parse_args()
    with threadpool_limits(1):  # fields are small: threads would wait for each other
        text = "\n".join(tables(given.plates, given.grasps))
    print(text)
    if given.write:
        RESULTS.write_text(f"# Likeness\n\nMade by `python -m studies.likeness --write`.\n\n{text}\n", encoding="utf-8")


def tables(plates: Path | None, grasps: Path | None) -> Iterator[str]:
    """Yield the tables of figures, and of explained variance where there are recordings."""
    yield table("biotac", BIOTAC)
    yield table("icub", ICUB)
    sensors = load_registry().sensors
    if plates:
        twin = patterns.simulated_plates(Bench(sensors["biotac"]))
        yield shares("BioTac, plates", patterns.compare_plates(patterns.read_plates(plates), twin))
    if grasps:
        presses = patterns.simulated_grasps(Bench(sensors["icub"]))
        yield shares("iCub fingertip, grasps", patterns.compare_grasps(patterns.read_grasps(grasps), presses))


def table(name: str, figures: tuple[Figure, ...]) -> str:
    """Return a sensor's figures beside those of real ones, as Markdown; those of several bands in one row."""
    sensor = load_registry().sensors[name]
    of = cache(lambda condition: CONDITIONS[condition](sensor))
    lines, met = [], 0
    for figure in figures:
        states: States = of(figure.condition)
        found = float(STATISTICS[figure.statistic](states.of(figure), figure))
        inside = figure.low <= found <= figure.high
        met += inside
        sets = f"sets the {figure.sets}" if figure.sets else ""
        cells = (figure.condition, figure.name, f"{figure.typical:.3g} [{figure.low:.3g}, {figure.high:.3g}]",
                 f"{found:.3g}" if inside else f"**{found:.3g}**", figure.source, sets)  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    head = ["| condition | figure | real [range] | simulated | source | |", "|---|---|---|---|---|---|"]
    title = f"{sensor.spec.title}: {met} of {len(figures)} within the range; those outside are bold."
    return "\n".join([title, "", *head, *lines, ""])


def shares(title: str, found: dict[str, float]) -> str:
    """Return the explained variance of one comparison, as Markdown."""
    rows = [f"| {name} | {value:.2f} |" for name, value in found.items()]
    return "\n".join([f"{title}, explained variance", "", "| | |", "|---|---|", *rows, ""])


if __name__ == "__main__":
    main()

"""Hold the simulated fingers against real ones."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import scipy.linalg  # noqa: F401  (its threads are limited below)
from threadpoolctl import threadpool_limits

from studies.likeness import patterns
from studies.likeness.figures import BIOTAC, ICUB, STATISTICS, Figure, States
from studies.likeness.scenes import CONDITIONS, Bench
from tactbench.plugin import load_registry

PAGE = Path(__file__).resolve().parents[2] / "docs" / "likeness.md"


def main() -> None:
    """Carry out what the options say."""
    parser = argparse.ArgumentParser(prog="python -m studies.likeness", description=__doc__)
    parser.add_argument("--plates", type=Path, help="folder of X1.txt, Y1.txt, X2.txt and Y2.txt")
    parser.add_argument("--grasps", type=Path, help="folder of recordings of iCub grasps")
    parser.add_argument("--write", action="store_true", help=f"into {PAGE.parent.name}/{PAGE.name}, too")
    given = parser.parse_args()
    with threadpool_limits(1):  # fields are small: threads would wait for each other
        found = dict(tables(given.plates, given.grasps))
    print("\n".join(found.values()))
    if given.write:
        PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), found), encoding="utf-8")


def written(page: str, found: dict[str, str]) -> str:
    """Return the page with what was found between its marks; a comparison that was not made keeps what stands there."""
    for name, text in found.items():
        start, end = (f"<!-- {word} {name} -->\n" for word in ("begin", "end"))
        before, _, rest = page.partition(start)
        page = f"{before}{start}\n{text}\n{end}{rest.partition(end)[2]}"
    return page


def tables(plates: Path | None, grasps: Path | None) -> Iterator[tuple[str, str]]:
    """Yield name and text: explained variance where there are recordings, and the figures."""
    sensors = load_registry().sensors
    if plates:
        twin = patterns.simulated_plates(Bench(sensors["biotac"]))
        yield "plates", shares("BioTac, plates", patterns.compare_plates(patterns.read_plates(plates), twin))
    if grasps:
        presses = patterns.simulated_grasps(Bench(sensors["icub"]))
        yield "grasps", shares("iCub, grasps", patterns.compare_grasps(patterns.read_grasps(grasps), presses))
    yield "biotac", table("biotac", BIOTAC)
    yield "icub", table("icub", ICUB)


def table(name: str, figures: tuple[Figure, ...]) -> str:
    """Return how many of a sensor's figures lie within the range of real ones, and those that do not, as Markdown."""
    sensor = load_registry().sensors[name]
    of = cache(lambda condition: CONDITIONS[condition](sensor))
    lines, met = [], 0
    for figure in figures:
        states: States = of(figure.condition)
        found = float(STATISTICS[figure.statistic](states.of(figure), figure))
        inside = figure.low <= found <= figure.high
        met += inside
        real = f"{figure.typical:.3g} [{figure.low:.3g}, {figure.high:.3g}]"
        cells = (figure.condition, figure.name, real, f"{found:.3g}", figure.source)
        lines += [] if inside else ["| " + " | ".join(cells) + " |"]
    head = ["| condition | figure | real [range] | simulated | source |", "|---|---|---|---|---|"]
    title = f"{sensor.spec.title}: {met} of {len(figures)} figures within the range; those outside:"
    return "\n".join([title, "", *head, *lines, ""])


def shares(title: str, found: dict[str, tuple[int, float]]) -> str:
    """Return the explained variance of one comparison and how many states it is of, as Markdown."""
    rows = [f"| {name} | {n} | {'' if math.isnan(value) else f'{value:.2f}'} |" for name, (n, value) in found.items()]
    return "\n".join([f"| {title} | states | explained variance, or correlation |", "|---|---|---|", *rows, ""])


if __name__ == "__main__":
    main()

"""Seconds and bytes of the HTML leaderboard, and how quickly a browser opens and sorts it.

The plain peer is `json.dumps` of the same rows, in the same rounds. Rows are made up (`board_rows.py`): every number is
random, which is the hardest to write small. The limits, for 1,000 lines of 50 tasks: 3 s and 2 MB; opening and a sort
1 s each. What a browser takes is asked of a headless Chromium, if there is one; with `--folder` the whole command is
timed too, from a result folder that somebody has made.

Usage: python benchmarks/board_size.py [LINES [TASKS [ROUNDS]]] [--folder DIR]
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from board_rows import make_rows

from tactbench.core.leaderboard.formats import page as page_of
from tactbench.core.leaderboard.table import build_table

ESTIMATORS = 10
TACTBENCH = str(Path(sys.executable).with_name("tactbench"))

OPENED = """
const [done] = [arguments[arguments.length - 1]];
const wait = () => document.documentElement.dataset.ready === "yes"
  ? requestAnimationFrame(() => setTimeout(() => done(performance.now()))) : setTimeout(wait, 1);
wait();
"""
SORTED = """
const [selector, done] = arguments;
const began = performance.now();
document.querySelector(selector).click();
requestAnimationFrame(() => setTimeout(() => done(performance.now() - began)));
"""
STEPS = {
    "sort the tables by fit, s": ("#view=tables", "#lines th:nth-of-type(9) button"),
    "sort the tables by sensor, s": ("#view=tables", "#lines th:nth-of-type(2) button"),
    "sort the matrix by a task, s": ("#view=matrix", "#matrix th:nth-of-type(5) button"),
    "draw score against time, s": ("#view=tables", "#tab-time"),
}


def timed(make, rounds: int) -> tuple[list[float], object]:
    """Return the seconds of each round, and what the last one made."""
    seconds, made = [], None
    for _ in range(rounds):
        began = time.perf_counter()
        made = make()
        seconds.append(time.perf_counter() - began)
    return seconds, made


def told(what: str, values: list[float]) -> None:
    """Print a line of medians."""
    print(f"{what:<34} {statistics.median(values):7.3f} [{min(values):.3f}, {max(values):.3f}]", flush=True)


def in_browser(page: Path, rounds: int) -> None:
    """Time opening and sorting in a headless Chromium."""
    browser = os.environ.get("TACTBENCH_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    driver = os.environ.get("TACTBENCH_CHROMEDRIVER") or shutil.which("chromedriver")
    if not browser or not driver:
        print("no chromium and chromedriver: opening and sorting are not timed")
        return
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"):
        options.add_argument(argument)
    running = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        opened: list[float] = []
        steps: dict[str, list[float]] = {what: [] for what in STEPS}
        for _ in range(rounds):
            running.get("about:blank")
            running.get(page.as_uri())
            opened.append(running.execute_async_script(OPENED) / 1e3)
            for what, (view, selector) in STEPS.items():
                running.execute_script("document.querySelector(`[data-view=${arguments[0]}]`).click()", view[6:])
                steps[what].append(running.execute_async_script(SORTED, selector) / 1e3)
        told("open, from its address to drawn, s", opened)
        for what, values in steps.items():
            told(what, values)
    finally:
        running.quit()


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("lines", type=int, nargs="?", default=1_000, help="pairs of sensor and estimator")
    parser.add_argument("tasks", type=int, nargs="?", default=50)
    parser.add_argument("rounds", type=int, nargs="?", default=5)
    parser.add_argument("--folder", type=Path, help="a result folder: the whole command is timed")
    asked = parser.parse_args()
    rows = make_rows(asked.lines // ESTIMATORS, ESTIMATORS, asked.tasks)
    print(f"{len(rows):,} cells, {os.cpu_count()} cores, {asked.rounds} rounds; median [min, max]")
    plain, text = timed(lambda: json.dumps(rows), asked.rounds)
    tables, _ = timed(lambda: build_table(rows), asked.rounds)
    pages, page = timed(lambda: page_of(build_table(rows)), asked.rounds)
    told("json.dumps of the rows, s", plain)
    told("the table alone, s", tables)
    told("the page, its table included, s", pages)
    told("page / json.dumps", [one / other for one, other in zip(pages, plain, strict=True)])
    print(f"bytes: page {len(page.encode()):,}, json {len(text.encode()):,}")
    if asked.folder:
        command = [TACTBENCH, "leaderboard", str(asked.folder), "--format", "html"]
        whole, made = timed(lambda: subprocess.run(command, capture_output=True, check=True), asked.rounds)
        told(f"tactbench leaderboard {asked.folder.name}, s", whole)
        print(f"bytes of its page: {len(made.stdout):,}")
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "board.html"
        file.write_text(page, encoding="utf-8")
        in_browser(file, asked.rounds)


if __name__ == "__main__":
    main()

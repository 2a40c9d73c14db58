"""Whether a leaderboard prints neighbours apart that its replicates cannot separate.

Reads the records of a result folder (``leaderboard.json``) and nothing else of tactbench: for all neighbouring answers
of a block, a paired t-test over the scores of their replicates (of errors of force with a floor, of the mean square
beyond it), by scipy, not by the code that ranked them.

Usage: python benchmarks/board_audit.py [DIR/leaderboard.json]
"""

from __future__ import annotations

import itertools
import json
import sys
from pathlib import Path
from typing import Any

from scipy.stats import ttest_rel

LEVEL = 0.05
LOWER_IS_BETTER = {"rmse", "mae"}


def separable(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Return whether the replicates that two answers share tell them apart."""
    kept = [row["replicates"] for row in (one, other)]
    if any(len(mine.get("scores", ())) < 5 for mine in kept):
        return False
    key = "excess" if all("excess" in mine for mine in kept) else "scores"
    values = [dict(zip(mine["names"], mine[key], strict=True)) for mine in kept]
    shared = sorted(set(values[0]) & set(values[1]))
    return bool(ttest_rel([values[0][name] for name in shared], [values[1][name] for name in shared]).pvalue < LEVEL)


def main() -> None:
    """Print what was found; exit with 1 if neighbours are printed apart that are not separable."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "tactbench-results/leaderboard.json")
    rows = [row for row in json.loads(path.read_text()) if row["rank"] is not None]
    blocks: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for row in rows:
        blocks.setdefault((row["task"], row["protocol"], str(row["split"])), []).append(row)
    wrong = 0
    for block, members in blocks.items():
        pairs = list(itertools.pairwise(members))
        told = [one["rank"] != other["rank"] for one, other in pairs]
        apart = [separable(one, other) for one, other in pairs]
        bad = [(one["cell"], other["cell"]) for (one, other), shown, real in zip(pairs, told, apart, strict=True)
               if shown and not real]  # fmt: skip
        wrong += len(bad)
        tied = sum(row["rank"] == members[0]["rank"] for row in members) - 1
        print(
            f"{' · '.join(block)}: {len(pairs)} neighbouring pairs, {sum(apart)} separable, {sum(told)} printed apart, "
            f"{len(bad)} of these not separable; {tied} share the first place"
        )
        for names in bad:
            print(f"  {names[0]} | {names[1]}")
    raise SystemExit(wrong > 0)


if __name__ == "__main__":
    main()

"""Freeze the scores of result folders, or compare result folders with what was frozen.

Made with commit ec0567c6 (recordings made elsewhere), 694290cd (simulated) and, of slip, 48b0fcf6,
in an environment of constraints.txt::

    tactbench run --out default
    tactbench run --config beyond --repeats 2 --out beyond
    tactbench import examples/mappings/eflesh-normal.yaml --root DATA/eflesh --out recordings/eflesh/normal
    tactbench import examples/mappings/eflesh-normal-raw.yaml --root DATA/eflesh --out recordings/eflesh/normal-raw
    tactbench import examples/mappings/eflesh-shear.yaml --root DATA/eflesh --out recordings/eflesh/shear
    tactbench import examples/mappings/eflesh-slip.yaml --root DATA/eflesh --out recordings/slip
    tactbench run --config tests/frozen/eflesh.yaml --recordings recordings/eflesh --out eflesh
    tactbench run --config tests/frozen/eflesh-slip.yaml --recordings recordings/slip --out eflesh-slip
    tactbench run --task slip --task contact-location --sensor biotac --repeats 1 --out kinds
    python tests/frozen/make.py freeze default beyond eflesh eflesh-slip kinds

`compare` in place of `freeze` compares folders of the same names, made by the same commands, and exits with 1 if a
number differs by more than a relative 1e-9, which is what other kinds of processor change.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np

from tactbench.core.matrix.store import Store

HERE = Path(__file__).parent
KEYS = (
    "status", "metric", "score", "ci_low", "ci_high", "reference_floor", "score_beyond_floor", "true_score", "n_train",
    "n_test", "split", "n_recordings", "chosen",
)  # fmt: skip
RELATIVE = 1e-9
KINDS = {
    "regression": ("eflesh", "eflesh/force/replay/deployable:session/forest,n_estimators=100/1"),
    "classification": ("default", "biotac/curvature/twin/karl2016/forest/1"),
    "vector": ("kinds", "biotac/contact-location/twin/"),
    "per-recording": ("eflesh-slip", "eflesh-slip/slip-sequence/replay/deployable:block/forest/1"),
    "events": ("kinds", "biotac/slip/twin/"),
}
"""Of each kind of answers: the folder, and how the name of the cell begins; the first that is no trivial answer."""


def scores_of(folder: Path) -> dict[str, dict[str, object]]:
    return {
        row["cell"]: {key: row[key] for key in KEYS} for row in sorted(Store(folder).rows(), key=lambda r: r["cell"])
    }


def answers_of(folder: Path, begins: str) -> dict[str, np.ndarray]:
    store = Store(folder)
    rows = [row for row in store.rows() if row["cell"].startswith(begins) and not row["is_baseline"]]
    row = min((row for row in rows if row["status"] == "done"), key=lambda one: one["cell"])
    test = store.answers(row["key"])["test"]
    return {name: getattr(test, name) for name in ("y_true", "y_pred", "recording", "row", "fold")}


def same(one: object, other: object) -> bool:
    """Return whether two values of a row agree, numbers to a relative `RELATIVE`."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, float) and isinstance(other, int | float):
        return math.isclose(one, other, rel_tol=RELATIVE, abs_tol=1e-12)
    return one == other


def differences(name: str, folder: Path) -> list[str]:
    """Return what differs in a folder from the frozen one of that name; cells that only the frozen one has count."""
    frozen = json.loads((HERE / f"{name}.json").read_text())
    now = scores_of(folder)
    found = [f"{cell}: only {'frozen' if cell in frozen else 'now'}" for cell in sorted(frozen.keys() ^ now.keys())]
    for cell in frozen.keys() & now.keys():
        found += [f"{cell}: {key} {frozen[cell][key]!r} frozen, {now[cell][key]!r} now"
                  for key in KEYS if not same(frozen[cell][key], now[cell][key])]  # fmt: skip
    for kind, (where, begins) in KINDS.items():
        if where == name:
            answers = answers_of(folder, begins)
            with np.load(HERE / f"{kind}.npz") as before:
                for column in before.files:
                    if before[column].shape != answers[column].shape or not np.allclose(
                        before[column], answers[column], rtol=RELATIVE, atol=1e-12, equal_nan=True
                    ):
                        found.append(f"answers of {kind}: {column} differs")
    return found


def main(verb: str, *folders: str) -> int:
    """Freeze or compare; return the exit code."""
    wrong = 0
    for folder in map(Path, folders):
        if verb == "freeze":
            (HERE / f"{folder.name}.json").write_text(json.dumps(scores_of(folder), indent=0) + "\n")
            for kind, (where, begins) in KINDS.items():
                if where == folder.name:
                    np.savez_compressed(HERE / f"{kind}.npz", **answers_of(folder, begins))
            continue
        found = differences(folder.name, folder)
        wrong += bool(found)
        print(f"{folder.name}: {len(scores_of(folder))} cells, {len(found)} differences")
        print("\n".join(found[:20]))
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

"""An ExtraTrees forest on public data sets, those named or all: a DataFrame of scores with intervals."""

import os
import sys

import pandas
from sklearn.ensemble import ExtraTreesClassifier, ExtraTreesRegressor

import tactbench

TASKS = {
    "eflesh-normal": "force", "eflesh-shear": "shear-force", "eflesh-location": "contact-location",
    "eflesh-slip": "slip-sequence", "biotacsp-stability": "grasp-stability", "icub-grasp": "object-identity",
}  # fmt: skip
lines = []
for name in sys.argv[1:] or TASKS:
    recordings = tactbench.dataset(name, root=os.environ.get("TACTBENCH_DATA"))  # None: fetched once, and kept
    forest = ExtraTreesClassifier if tactbench.load_task(TASKS[name], recordings).classes else ExtraTreesRegressor
    found = tactbench.evaluate(forest(n_jobs=-1, random_state=0), TASKS[name], recordings)
    columns = ("task", "metric", "split", "score", "ci_low", "ci_high", "baseline", "fit_s")
    lines.append({"data set": name} | {column: found.row[column] for column in columns})
print(pandas.DataFrame(lines).to_string(index=False))

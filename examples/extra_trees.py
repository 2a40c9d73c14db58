"""A forest on public data sets: ``extra_trees.py eflesh-normal:force icub-grasp:object-identity:FOLDER_OF_A_COPY``."""

import sys

import pandas
from sklearn.ensemble import ExtraTreesClassifier, ExtraTreesRegressor

import tactbench

lines = []
for argument in sys.argv[1:]:
    name, task, *root = argument.split(":")
    recordings = tactbench.dataset(name, *root)
    forest = ExtraTreesClassifier if tactbench.load_task(task, recordings).classes else ExtraTreesRegressor
    found = tactbench.evaluate(forest(n_jobs=-1, random_state=0), task, recordings)
    columns = ("task", "metric", "split", "score", "ci_low", "ci_high", "baseline", "fit_s")
    lines.append({"data set": name} | {column: found.row[column] for column in columns})
print(pandas.DataFrame(lines).to_string(index=False))

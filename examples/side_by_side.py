"""Four models of one's own on five data sets: ``python examples/side_by_side.py [ROOT]``; ROOT holds copies of them."""

import sys

import numpy as np
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import PolynomialFeatures

import tactbench


class WindowRegression:
    def fit(self, X, y):
        self.weights = np.linalg.lstsq(self.flat(X), y, rcond=None)[0]

    def predict(self, X):
        return self.flat(X) @ self.weights

    def flat(self, X):
        return np.hstack([X.reshape(len(X), -1), np.ones((len(X), 1))])


pads = {"eflesh-normal": "force", "eflesh-normal-raw": "force", "eflesh-shear": "shear-force"}
tasks = {**pads, "eflesh-shear-raw": "shear-force", "fluid-force": "force"}
models = {
    "polynomial": make_pipeline(PolynomialFeatures(2), Ridge()),
    "search": GridSearchCV(Ridge(), {"alpha": [0.1, 1, 10]}, cv=GroupKFold(3)),
    "window": WindowRegression(),
    "trees": ExtraTreesRegressor(50, random_state=0),
}
table = tactbench.run(
    data={name: tactbench.dataset(name, *sys.argv[1:]) for name in tasks}, estimators=models, tasks=tasks,
    split={**dict.fromkeys(pads, "press"), "eflesh-shear-raw": GroupKFold(5), "fluid-force": "placement"},
    groups={"eflesh-shear-raw": "press"}, metric={"eflesh-shear": "mae"}, window={"window": 5}, out="side-by-side",
)  # fmt: skip
print(table, table.compare("trees", "window"), sep="\n\n")

"""The plain script that the main job is held against: scikit-learn, the same arrays, the same forest.

Usage: python plain_forest.py ARRAYS.npz SEED
"""

import sys

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import f1_score

with np.load(sys.argv[1]) as arrays:
    X_train, y_train, X_validation, y_validation, X_test, y_test = (
        arrays[name] for name in ("X_train", "y_train", "X_validation", "y_validation", "X_test", "y_test")
    )
forest = RandomForestClassifier(n_estimators=500, random_state=int(sys.argv[2]))
forest.fit(X_train, y_train)
validation = f1_score(y_validation, forest.predict(X_validation), average="macro")
test = f1_score(y_test, forest.predict(X_test), average="macro")
print(f"macro F1: validation {validation:.6f}, test {test:.6f}")

"""The plain script that the main job is held against: scikit-learn, the same arrays, the same forests.

Usage: python plain_forest.py ARRAYS.npz SEED [ARRAYS.npz SEED ...]
"""

import sys

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import f1_score

for file, seed in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
    with np.load(file) as arrays:
        X_train, y_train, X_validation, y_validation, X_test, y_test = (
            arrays[name] for name in ("X_train", "y_train", "X_validation", "y_validation", "X_test", "y_test")
        )
    forest = RandomForestClassifier(n_estimators=500, random_state=int(seed))
    forest.fit(X_train, y_train)
    f1_score(y_validation, forest.predict(X_validation), average="macro")
    print(f"{f1_score(y_test, forest.predict(X_test), average='macro'):.6f}")

"""A plugin that is merely installed changes no recording and no key."""

import h5py
import numpy as np


def recordings(verbs, out, *more, plugins=("patching",)):
    """Return the readings of a run's recordings, by the names of the files, which hold the keys."""
    asked = ("run", "--sensor", "icub", "--task", "force", "--estimator", "mean", "--repeats", "1")
    verbs(*asked, "--out", out, *more, plugins=plugins)
    found = {}
    for path in sorted((verbs.folder / out / "recordings").rglob("*.h5")):
        with h5py.File(path) as file:
            found[path.name] = file["streams/taxels/data"][:]
    return found


def test_an_effect_that_changes_numpy_when_it_is_imported_does_so_only_where_it_is_named(verbs):
    without, unnamed = recordings(verbs, "without", plugins=()), recordings(verbs, "unnamed")
    assert without.keys() == unnamed.keys()
    assert all(np.array_equal(without[name], unnamed[name]) for name in without)
    named = recordings(verbs, "named", "--effects", "patching")
    assert named.keys().isdisjoint(without)
    assert all(not np.array_equal(a, b) for a, b in zip(named.values(), without.values(), strict=True))

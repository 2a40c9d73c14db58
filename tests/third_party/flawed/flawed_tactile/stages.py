"""What effects do, and when they are called for."""

import itertools

import numpy as np

from tactbench.plugin.simulation import Reason

turns = itertools.count()


def never(scene, sensor):
    return Reason(False, "only by name", 0.0)


def sound(run):
    for track in run.tracks:
        track.readings += 0.01 * run.of_recording("ripple", *track.scope).standard_normal(track.readings.shape)


def that_breaks(run):
    raise ZeroDivisionError("no load yet")


def of_nan(run):
    run.reference_n = run.reference_n * np.nan


def that_draws_elsewhere(run):
    run.reference_n = run.reference_n + np.random.default_rng().normal(0.0, 0.01, run.reference_n.shape)


def that_changes_the_sensor(run):
    run.scene.labels["rippled"] = next(turns)


def that_says_yes(scene, sensor):
    return False


def without_a_reason(scene, sensor):
    return Reason(False, "", 0.0)


def of_two_minds(scene, sensor):
    return Reason(False, f"only by name, {next(turns)}", 0.0)

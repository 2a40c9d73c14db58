"""The same taxels are dead in all recordings of a unit."""

import numpy as np
from tactbench.plugin.simulation import EffectRun, EffectTrack

SHARE = 0.1  # where it is asked for by name and the sensor states none: assumed


def apply(run: EffectRun) -> None:
    """Let each taxel be dead with the stated probability."""
    stated = run.sensor.spec.parameters.get("dead_taxels")
    share = SHARE if stated is None else stated.to("1")
    names = [channel.name for channel in run.sensor.spec.channels("taxel")]
    dead = np.array(names)[run.of_unit("dead-taxels").uniform(size=len(names)) < share]
    for track in run.tracks:
        stay(track, frozenset(dead.tolist()))


def stay(track: EffectTrack, dead: frozenset[str]) -> None:
    """Let the channels named stay at their first reading."""
    for column, channel in enumerate(track.channels):
        if channel.name in dead:
            track.readings[:, column] = track.readings[0, column]

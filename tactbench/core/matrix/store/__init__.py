"""The result folder: one file for each evaluated cell, and an index of these files.

::

    OUT/
      cells/KEY.h5                       one cell: its row, sections of its key, provenance and answers
      results.sqlite                     an index of cells/ and recordings/, rebuilt if lost or outdated
      recordings/SENSOR/SCENE-KEY.h5     recordings made by a rig
      leaderboard.md, .csv, .json        leaderboard of the last run
"""

from tactbench.core.matrix.store.store import Row, Store, writing

__all__ = ["Row", "Store", "writing"]

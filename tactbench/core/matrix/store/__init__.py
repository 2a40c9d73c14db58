"""The result folder: a file for each cell that ended, and an index over them.

::

    OUT/
      cells/KEY.h5                       one cell: its row, what its key is made of, its provenance, its answers
      results.sqlite                     an index of cells/ and recordings/, made anew when it is lost or old
      recordings/SENSOR/SCENE-KEY.h5     what a rig recorded
      leaderboard.md, .csv, .json        the table of the last run
"""

from tactbench.core.matrix.store.store import Row, Store, writing

__all__ = ["Row", "Store", "writing"]

"""The result folder: one shard a cell, and a ledger that lists thousands of them in a second.

::

    OUT/
      index.jsonl                        the ledger: every cell that ever ended, one a line, only ever appended to
      cells/KEY.h5                       one finished cell: its row, its provenance, a group of answers for each role
      provenance/ID.json                 who computed cells, with what: one for each kind of run
      recordings/SENSOR/SCENE-KEY.h5     what the rig recorded
      scores.json                        what a seed decides in the last run: compare it byte by byte
      leaderboard.md, .csv, .json        the last run's table
      run.json                           the provenance of the last run
      cache/                             what only saves time, and which run holds the folder

Rooms: `folder` is the whole (:class:`Store`), `ledger` the lines, `sharing` what lines have in common, `rows` what a
row may hold, `shard` the answers of one cell, `lock` one run at a time, `leftovers` what a killed run leaves, `disk`
words for what a disk refuses, `limits` how much is read from a folder that may be a stranger's. ``docs/results.md``
describes the format.
"""

from tactbench.core.matrix.store.folder import Store
from tactbench.core.matrix.store.rows import NotPlainError, Row

__all__ = ["NotPlainError", "Row", "Store"]

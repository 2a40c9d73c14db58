"""How much is read of a result folder: it may be a stranger's, and is data whatever it says."""

import re

LEDGER_BYTES = 2**29
"""Half a gigabyte: some 200,000 cells."""
LINE_BYTES = 2**24
ENTRIES = 1_000_000
DEPTH = 32
"""Lists and mappings inside each other; ours have six."""
SHARED_CHARACTERS = 2**31
"""What all rows of a ledger amount to once what they share is written out in each."""
SHARD_BYTES = 2**30
FEW_BYTES, LARGEST_RATIO = 2**26, 64
"""Of the answers of one role, in memory: any number up to the first, and so many for each byte of the shard."""
PROVENANCE_BYTES = 2**20
TEXT_CHARACTERS = 2**16
"""Of a log or a traceback, when it is written."""

_KEY = re.compile(r"[0-9a-f]{32}")


def is_key(text: object) -> bool:
    """Return whether `text` is the key of a cell: keys are names of files."""
    return isinstance(text, str) and _KEY.fullmatch(text) is not None

"""Numbers that a report computes once: kept in the result folder, found again by everything that decides them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tactbench.core.files import read_regular, replace_file

FOLDER = "report"
"""Inside a result folder."""
_MOST_BYTES = 2**26
"""Of a file of numbers."""


def stored(results: Path, kind: str, facts: Mapping[str, Any], compute: Callable[[], Mapping[str, Any]]) -> Any:
    """Return what `compute` returns, from disk if it was computed for the same `facts` before.

    Parameters
    ----------
    results
        The result folder; the file is ``report/KIND/DIGEST.json`` in it.
    kind
        What is stored: the name of a folder.
    facts
        Everything that decides the numbers, fit for JSON. Any other fact, any other file.
    compute
        Returns numbers, strings, lists and mappings; floats are read back exactly.

    Notes
    -----
    A file that is damaged is made anew, and a folder that cannot be written costs the next reader the time, no more.
    """
    key_text = json.dumps(facts, sort_keys=True)
    path = results / FOLDER / kind / f"{hashlib.sha256(key_text.encode()).hexdigest()[:32]}.json"
    try:
        found = json.loads(read_regular(path, _MOST_BYTES))
        if found["facts"] == json.loads(key_text):
            return found["numbers"]
    except (OSError, ValueError, KeyError, TypeError):
        pass
    numbers = compute()
    text = json.dumps({"facts": facts, "numbers": numbers}, sort_keys=True, allow_nan=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, f"{text}\n".encode())
    except OSError:
        pass
    return json.loads(text)["numbers"]

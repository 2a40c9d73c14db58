"""Foreign tables become recordings, as a mapping file says: no code, nothing guessed, nothing invented.

``model`` is what a mapping may say; ``files`` finds tables and the words in their paths; ``text``, ``sheets``,
``arrays`` and ``bags`` read them into a ``table``; ``channels`` turns columns into channels; ``samples`` into numbers
with a quality each; ``importing`` does all of it.
"""

from tactbench.core.recording.mapping.importing import Imported, ImportReport, import_tables

__all__ = ["ImportReport", "Imported", "import_tables"]

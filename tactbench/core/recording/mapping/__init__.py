"""Import of foreign tables into recordings, as a mapping file describes them.

``model`` has the keys of a mapping file. ``files`` finds the tables, and the words in their paths; ``text``,
``sheets``, ``arrays``, ``parquet`` and ``bags`` read them into a ``table``. ``channels`` names the channels,
``samples`` converts cells into samples with a quality each, and ``importing`` writes the recordings.
"""

from tactbench.core.recording.mapping.importing import Imported, ImportReport, import_tables

__all__ = ["ImportReport", "Imported", "import_tables"]

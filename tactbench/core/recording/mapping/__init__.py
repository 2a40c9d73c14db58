"""Import of foreign tables into recordings, as a mapping file describes them.

``model`` defines the keys of a mapping file. ``files`` finds files and words (named values) in their paths; ``table``
and ``formats`` read tables. ``channels`` names the channels, ``samples`` converts cells into samples with a quality
each, and ``importing`` writes the recordings.
"""

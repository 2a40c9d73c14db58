"""Recordings: the file format, how it is written and read, whether it is healthy, and foreign tables."""

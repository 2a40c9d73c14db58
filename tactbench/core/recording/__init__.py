"""Recordings: their file format, reading and writing them, checking their health, and importing foreign tables."""

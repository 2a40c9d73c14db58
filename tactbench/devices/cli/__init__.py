"""Verbs of the command line about devices."""

"""Provenance of results: source, versions, machine."""

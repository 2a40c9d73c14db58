"""Provenance of results: digests of source code, versions of software, and the machine."""

"""The conformance floor."""

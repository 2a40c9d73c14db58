"""A benchmark run described by options, as used by the command line and by the Python functions."""

"""The simulation held against what must be true."""

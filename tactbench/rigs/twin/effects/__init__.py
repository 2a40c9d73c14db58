"""Effects of the twin, one a file; ``declarations`` says which there are without importing any."""

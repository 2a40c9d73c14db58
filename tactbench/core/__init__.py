"""Core of tactbench, which contains no sensor, task or rig by name, and finds them all by entry points."""

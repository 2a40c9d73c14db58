"""The frame: it never names a sensor, a task or a rig, and reaches all of them by entry points."""

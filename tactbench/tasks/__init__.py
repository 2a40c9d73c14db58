"""Tasks: targets, scenes, metrics and splits of a benchmark."""

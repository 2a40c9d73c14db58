"""Search for installed sensors, rigs, tasks, estimators and effects."""

"""Search for installed sensors, rigs, tasks, estimators, effects and other plugins."""

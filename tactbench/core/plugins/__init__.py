"""How sensors, rigs, tasks, estimators and effects are found."""

"""Evaluation of estimators, from recordings to a score: data sets, protocols, splits, metrics and intervals."""

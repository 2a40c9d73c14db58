"""From recordings to a score: dataset, protocol, split, estimator, metric, interval, one cell."""

"""What accuracy costs in time: fronts, tables and figures of points."""

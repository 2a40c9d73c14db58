"""Measures what accuracy costs in time, of estimators and of a simulated rig."""

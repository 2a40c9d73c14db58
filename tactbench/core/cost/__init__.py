"""Measurement of the time that accuracy costs, for estimators and for a simulated rig."""

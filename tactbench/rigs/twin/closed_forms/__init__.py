"""Contacts that have been solved on paper: for the ladder's lowest rung and for checks. Millimetres, newtons, MPa."""

"""Tactile sensors: one room each."""

"""The response of the skin to a load: media, solvers and load tables."""

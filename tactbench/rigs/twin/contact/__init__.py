"""How the skin answers a load: media, the Newton solver, load tables."""

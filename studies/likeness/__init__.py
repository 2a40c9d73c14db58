"""How like real fingers the simulated ones are; see README.md."""

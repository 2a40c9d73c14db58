"""What the simulated rig cannot know, drawn from priors and held against published numbers."""

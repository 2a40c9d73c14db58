"""What comes between the scene and the skin, and between the skin and the stored number: one effect per file."""

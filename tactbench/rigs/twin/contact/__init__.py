"""Normal contact: what the skin is made of, one load, and many loads. Units mm, N, MPa."""

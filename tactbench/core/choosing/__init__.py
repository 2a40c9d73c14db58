"""Which sensor meets a wish."""

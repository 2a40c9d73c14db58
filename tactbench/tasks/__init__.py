"""Questions asked of recordings."""

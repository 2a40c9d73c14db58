"""Where work is done, and what guards it: here, in a process of its own each, or in processes that are reused."""

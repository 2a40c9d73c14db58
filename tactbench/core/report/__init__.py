"""The paper's tables and figures, and one page with all of them, from stored results."""

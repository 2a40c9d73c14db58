"""The table of text, and its renderers for terminal, Markdown, LaTeX, CSV and HTML."""

"""The one table of text, and what renders it: terminal, Markdown, LaTeX, CSV, HTML."""

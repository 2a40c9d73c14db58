"""Tables of text, and their output on a terminal, as Markdown, LaTeX, CSV and HTML."""

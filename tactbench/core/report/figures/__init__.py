"""The paper's figures, one a file, from the results in a folder."""

"""One run asked for in typed words: what the verbs and the functions of Python both call."""

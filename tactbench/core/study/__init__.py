"""One run, described by options: the verbs and the functions of Python both call this room."""

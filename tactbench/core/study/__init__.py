"""One run, described by options, for the verbs and for the functions of Python."""

"""Effects of the twin other than contact: on the load, on the skin and on the readings."""

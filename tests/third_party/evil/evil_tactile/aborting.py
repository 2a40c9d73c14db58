"""Cannot even be imported."""

import os

os.abort()

"""``python -m tactbench`` and the ``tactbench`` command."""

from tactbench.core.cli import main

if __name__ == "__main__":
    main()

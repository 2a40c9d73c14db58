"""Entry point of ``python -m tactbench`` and of the ``tactbench`` command."""

from tactbench.core.cli import main

if __name__ == "__main__":
    main()

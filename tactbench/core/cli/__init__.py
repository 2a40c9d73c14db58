"""The command line: one verb per file."""


def main() -> None:
    """Run the command line."""

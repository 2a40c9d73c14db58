"""What made a result: source, versions, machine."""

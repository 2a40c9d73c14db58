"""What may stand side by side in a comparison; apart from its code, so that asking for help loads no numerics."""

AXES = ("protocol", "split", "fold")

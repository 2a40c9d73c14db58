"""What things are: frozen models without behaviour, readable on one screen each."""

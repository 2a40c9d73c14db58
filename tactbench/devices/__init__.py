"""Devices on links: what a driver and an emulator are, reading several at once, and emulators behind links."""

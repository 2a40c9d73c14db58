"""Devices on links: base classes of drivers and emulators, reading of several devices at once, emulated links."""

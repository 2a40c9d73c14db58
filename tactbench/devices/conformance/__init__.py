"""Checks of drivers, on emulators and on real lines."""

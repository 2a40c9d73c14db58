"""Subcommands of the command line for devices."""

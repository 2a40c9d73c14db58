"""Emulated devices on links: in virtual time within one thread, or in real time on links of the operating system."""

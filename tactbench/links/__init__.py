"""Links between drivers and devices: byte streams, CAN, datagrams and SPI, which open, close and fail alike.

See ``docs/links.md``.
"""

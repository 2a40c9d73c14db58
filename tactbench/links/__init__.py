"""Links: what drivers speak through. Byte streams, CAN, datagrams and SPI that open, end and fail alike.

See ``docs/links.md``.
"""

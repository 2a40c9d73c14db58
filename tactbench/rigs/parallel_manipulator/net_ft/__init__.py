"""The ATI Net F/T box: raw data transfer over UDP."""

"""The linear motor on an RS232 line: a Faulhaber drive of the 300x RS generation, spoken to in ASCII."""

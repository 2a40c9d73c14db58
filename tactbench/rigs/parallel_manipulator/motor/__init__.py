"""The linear motor on a Faulhaber drive of the 300x RS generation, with ASCII commands over RS232."""

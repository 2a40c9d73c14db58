"""The process pool: items of work in child processes, each within limits of time and memory."""

"""The process pool: work in child processes, within limits of time and memory."""

from tactbench.core.pool.limits import UNLIMITED, Limits
from tactbench.core.pool.pool import InProcess, Pool, start_server

__all__ = ["UNLIMITED", "InProcess", "Limits", "Pool", "start_server"]

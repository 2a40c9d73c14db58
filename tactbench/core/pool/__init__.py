"""The process pool: carries out work in child processes, within limits of time and memory."""

from tactbench.core.pool.child import UNLIMITED, Limits
from tactbench.core.pool.pool import Engine, InProcess, Pool, preload

__all__ = ["UNLIMITED", "Engine", "InProcess", "Limits", "Pool", "preload"]

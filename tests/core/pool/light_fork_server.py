"""Loaded by Dask workers whose cells need no library: their fork servers then start in a tenth of the time."""

from tactbench.core.pool import worker

worker.PRELOAD = ("tactbench.core.pool.worker", "tests.core.pool.remote_work")

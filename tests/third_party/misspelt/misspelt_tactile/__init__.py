"""A plugin whose author misspelt the hook."""

from tactbench.plugin import hookimpl

TACTBENCH_API = 2


@hookimpl
def tactbench_sensor():
    return []

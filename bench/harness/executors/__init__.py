"""Where blocks are measured, by its address: in this process, or by the workers of a cluster."""

from ..executor import THIS_PROCESS, Executor

LOCAL, DASK = "local", "dask://"


def executor_at(address: str, mix_machines: bool = False) -> Executor:
    """Return the executor of an address.

    Raises:
        ValueError: if the executor does not exist, needs a package that is not installed, or
            does not answer.
    """
    if address == LOCAL:
        return THIS_PROCESS
    scheduler = address.removeprefix(DASK)
    host, _, port = scheduler.rpartition(":")
    if scheduler == address or not (host and port.isdigit()):
        raise ValueError(f"--executor: expected local or dask://HOST:PORT, got {address!r}")
    from .dask import DaskExecutor

    return DaskExecutor(scheduler, mix_machines)

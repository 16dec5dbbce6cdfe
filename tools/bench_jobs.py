"""Jobs over this machine's cores, or over a Dask cluster; what they give is the same."""

import multiprocessing
import os
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait

from .errors import BadInput

__all__ = ["run_jobs"]

_CONNECT_SECONDS = 20


def run_jobs(function, jobs, *, num_workers=1, scheduler=None):
    """Yields ``(job, function(job))`` of each of ``jobs``, in the order in which they are done.

    Parameters
    ----------
    function : callable
        Of a module, so that other processes find it.
    jobs : list
    num_workers : int
        Processes on this machine; one job at a time is done in this process.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers have the same version of this package, and the scenes at the same
        place; then ``num_workers`` counts nothing.

    Raises
    ------
    BadInput
        If there is no Dask, or no scheduler at the address.
    Exception
        Whatever a job raises; the others that wait are given up.
    """
    if scheduler is not None:
        yield from _on_cluster(function, jobs, scheduler)
    elif num_workers == 1 or len(jobs) < 2:
        for job in jobs:
            yield job, function(job)
    else:
        yield from _on_cores(function, jobs, num_workers)


def _share_cores(num_threads):
    import numba

    numba.set_num_threads(num_threads)


def _on_cores(function, jobs, num_workers):
    num_threads = max(1, (os.cpu_count() or 1) // num_workers)
    # Not forked: numba and the simulator have threads.
    pool = ProcessPoolExecutor(num_workers, mp_context=multiprocessing.get_context("spawn"), initializer=_share_cores,
                               initargs=(num_threads,))
    futures = {pool.submit(function, job): job for job in jobs}
    try:
        while futures:
            for future in wait(futures, return_when=FIRST_COMPLETED).done:
                yield futures.pop(future), future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _on_cluster(function, jobs, scheduler):
    try:
        import distributed
    except ImportError as error:
        raise BadInput("--scheduler: Dask is not installed; run make setup, or pip install 'dynrt[bench]'") from error
    try:
        client = distributed.Client(scheduler, timeout=_CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise BadInput(f"--scheduler: there is no Dask scheduler at {scheduler}; start one with dask scheduler, and "
                       "workers with dask worker ADDRESS") from error
    with client:
        futures = {client.submit(function, job, pure=False): job for job in jobs}
        try:
            for future in distributed.as_completed(list(futures), loop=client.loop):
                yield futures[future], future.result()
        finally:
            client.cancel(list(futures))

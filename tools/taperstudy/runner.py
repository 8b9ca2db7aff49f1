"""Runs jobs on Dask: on processes of this machine, or on the workers of a cluster; or one by one without it."""

import contextlib
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from taperlib.files import InputError

from .cases import Job
from .worker import Failure, Files, Programs, attempt

CONNECT_TIMEOUT_S = 20
LONG_POLICIES = ("soc-mpc-log", "mpc-log")


class CaseError(Exception):
    """A case failed. `key` names it, the text tells why."""

    def __init__(self, key: str, reason: str) -> None:
        super().__init__(reason)
        self.key = key


@dataclass(frozen=True)
class Where:
    """`scheduler`: address of a cluster; None: so many processes here, of which one needs no Dask."""

    workers: int
    scheduler: str | None = None
    scratch: Path = Path("build/study/dask")


def _longest_first(jobs: dict[str, Job]) -> list[str]:
    """Long runs at the end would leave the other workers idle."""
    return sorted(jobs, key=lambda key: (jobs[key].policy not in LONG_POLICIES, "mpc" not in jobs[key].policy,
                                         jobs[key].tick_s))


@contextlib.contextmanager
def _client(where: Where) -> Iterator:
    import dask
    from distributed import Client, LocalCluster

    dask.config.set({"temporary_directory": str(where.scratch), "distributed.admin.tick.limit": "1h"})
    if where.scheduler is None:
        with LocalCluster(n_workers=where.workers, threads_per_worker=1, dashboard_address=":0",
                          memory_limit=0, silence_logs=logging.ERROR) as cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(where.scheduler, timeout=CONNECT_TIMEOUT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--scheduler {where.scheduler}: no Dask scheduler answers there: {error}") from None
    with client:
        if not client.scheduler_info(n_workers=-1)["workers"]:
            raise InputError(f"--scheduler {where.scheduler}: the cluster has no workers")
        yield client


def _on_dask(jobs: dict[str, Job], programs: Programs, where: Where) -> Iterator[tuple[str, Files | Failure]]:
    from distributed import KilledWorker, as_completed

    with _client(where) as client:
        futures = {client.submit(attempt, jobs[key], programs, key=f"study-{key}"): key for key in _longest_first(jobs)}
        for future in as_completed(list(futures)):
            key = futures.pop(future)
            try:
                result = future.result()
            except KilledWorker as error:
                raise CaseError(key, f"its worker ended: {error}") from None
            except (ModuleNotFoundError, RuntimeError) as error:  # the latter from Dask itself, which tells no more
                raise CaseError(key, f"{error or type(error).__name__}\nWhere scheduler or workers are of another version of "
                                     "Python or its packages, or have no tools folder of the project in PYTHONPATH, they "
                                     "cannot read the case.") from None
            yield key, result


def _one_by_one(jobs: dict[str, Job], programs: Programs) -> Iterator[tuple[str, Files | Failure]]:
    for key, job in jobs.items():
        yield key, attempt(job, programs)


def run_jobs(jobs: dict[str, Job], programs: Programs, where: Where, keep: Callable[[str, Files], None]) -> None:
    """Calls `keep` here for each job as it ends. Raises CaseError at the first that fails, the others are given up."""
    alone = where.scheduler is None and where.workers == 1
    for key, files in _one_by_one(jobs, programs) if alone else _on_dask(jobs, programs, where):
        if isinstance(files, Failure):
            raise CaseError(key, files.reason)
        keep(key, files)

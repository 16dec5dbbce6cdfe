"""Jobs here, on several cores and on a Dask cluster."""

import math

import pytest

from tools.bench_jobs import run_jobs
from tools.errors import BadInput

JOBS = [1.0, 4.0, 9.0]
ROOTS = {1.0: 1.0, 4.0: 2.0, 9.0: 3.0}


def root(number):
    return math.sqrt(number)


@pytest.fixture(scope="module")
def scheduler():
    distributed = pytest.importorskip("distributed")
    options = dict(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None)
    with distributed.LocalCluster(**options) as cluster:
        yield cluster.scheduler_address


def test_one_after_the_other():
    assert list(run_jobs(root, JOBS)) == list(ROOTS.items())


def test_on_cores():
    assert dict(run_jobs(root, JOBS, num_workers=2)) == ROOTS


def test_on_a_cluster(scheduler):
    assert dict(run_jobs(root, JOBS, scheduler=scheduler)) == ROOTS


@pytest.mark.parametrize("where", ["here", "cores", "cluster"])
def test_what_a_job_raises_is_let_out(where, request):
    options = {"here": {}, "cores": {"num_workers": 2},
               "cluster": {"scheduler": request.getfixturevalue("scheduler")} if where == "cluster" else {}}[where]
    with pytest.raises(ValueError):
        list(run_jobs(root, [4.0, -1.0], **options))


def test_no_scheduler(monkeypatch):
    monkeypatch.setattr("tools.bench_jobs._CONNECT_SECONDS", 1)
    with pytest.raises(BadInput) as error:
        list(run_jobs(root, JOBS, scheduler="tcp://127.0.0.1:1"))
    assert error.value.message == ("--scheduler: there is no Dask scheduler at tcp://127.0.0.1:1; start one with dask "
                                   "scheduler, and workers with dask worker ADDRESS")

"""A study on two worker processes of Dask distributed, compared with the same study in this process."""

import os
import signal

import pytest

import eft
from eft.cli import main

RIG = eft.Rig.zhao2005()
COMMAND = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=4.0, duration=4.0, sample_rate=2048.0)
SAMPLER = eft.studies.LatinHypercube(
    {"servovalve.flow_gain_scale": (0.9, 1.1), "structure.damping": (1e3, 9e3)}, n=60, seed=1
)


@pytest.fixture(scope="module")
def client():
    import dask

    # One process imports the packages, and workers are copies of it. Read at the import of distributed.
    dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"})
    import distributed

    with (
        # The scheduler may try this long to fetch a row from a worker that has just been killed.
        dask.config.set({"distributed.comm.timeouts.connect": "5s"}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster, timeout="60s") as client,
    ):
        yield client


@pytest.fixture(scope="module")
def here():
    return list(eft.study(RIG, COMMAND, SAMPLER))


def test_rows_are_those_of_this_machine(client, here, tmp_path):
    study = eft.study(
        RIG, COMMAND, SAMPLER, executor=client.get_executor(pure=False), chunk=4, output=tmp_path / "s"
    )
    assert list(study) == here


def test_a_worker_killed_in_the_middle_loses_no_row(client, here):
    victims = client.run(os.getpid)
    killed = []

    def kill_once(done, total):
        if not killed:
            assert done < total
            killed.append(next(iter(victims.values())))
            os.kill(killed[0], signal.SIGKILL)

    study = eft.study(RIG, COMMAND, SAMPLER, executor=client.get_executor(), chunk=2, progress=kill_once)
    assert list(study) == here
    client.wait_for_workers(2, timeout=60)
    assert killed[0] not in client.run(os.getpid).values(), "the worker was never killed"


def test_the_command_line_sends_a_study_to_a_scheduler(client, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sweep = 'kind = "sweep"\namplitude = 8900.0\nf_start = 0.5\nf_end = 4.0\nduration = 1.0\n'
    text = f"{RIG.to_toml()}\n[command]\n{sweep}[study.grid]\ncompensation.level = [0.9, 1.0]\n"
    (tmp_path / "s.toml").write_text(text)
    assert main(["study", "s.toml", "--dask", client.scheduler.address]) == 0
    command = eft.sine_sweep(8900.0, 0.5, 4.0, 1.0, 4096.0)
    assert list(eft.Study.load("s.study")) == list(
        eft.study(RIG, command, {"compensation.level": [0.9, 1.0]})
    )

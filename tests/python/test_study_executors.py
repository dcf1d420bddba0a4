"""Studies on executors: the rows are equal, and a lost worker loses no other test."""

import ast
import subprocess
import sys
import textwrap
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import pytest

import eft
from studies import COMMAND, GRID, RIG, rows


@pytest.mark.parametrize("workers", [1, 2, 3])
@pytest.mark.parametrize("pool", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_rows_are_the_same_whatever_the_engine(pool, workers, tmp_path):
    here = rows(eft.study(RIG, COMMAND, GRID))
    with pool(workers) as executor:
        study = eft.study(RIG, COMMAND, GRID, executor=executor, chunk=1, output=tmp_path / "s")
    assert rows(study) == here


class Treacherous(Executor):
    """Breaks on some tests, whatever they come with."""

    def __init__(self, bad, error):
        self.bad, self.error = bad, error

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        if self.bad & {test.index for test in args[0].tests}:
            future.set_exception(self.error)
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_a_test_that_takes_its_worker_along_loses_no_other(tmp_path):
    here = rows(eft.study(RIG, COMMAND, GRID))
    executor = Treacherous({4}, RuntimeError("worker died"))
    study = eft.study(RIG, COMMAND, GRID, executor=executor, chunk=3, output=tmp_path / "s")
    assert [r["status"] for r in study] == ["completed"] * 4 + ["failed", "completed"]
    assert study.row(4)["error"] == "RuntimeError: worker died"
    assert [r for r in study if r["index"] != 4] == [r for r in here if r["index"] != 4]
    # Tests that failed by accident run again.
    assert rows(eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")) == here


def test_a_broken_pool_ends_the_study_and_keeps_what_was_done(tmp_path):
    executor = Treacherous({4}, BrokenProcessPool("gone"))
    with pytest.raises(BrokenProcessPool):
        eft.study(RIG, COMMAND, GRID, executor=executor, chunk=1, output=tmp_path / "s")
    assert len(eft.Study.load(tmp_path / "s")) > 0
    assert rows(eft.study(RIG, COMMAND, GRID, output=tmp_path / "s")) == rows(eft.study(RIG, COMMAND, GRID))


class Unstarted(ProcessPoolExecutor):
    """A pool of which the first chunk ends with an error and the others wait."""

    def __init__(self, error):
        super().__init__(1)
        self.error, self.futures, self.ended = error, [], []

    def submit(self, fn, /, *args, **kwargs):
        self.futures.append(Future())
        if len(self.futures) == 1:
            self.futures[0].set_exception(self.error)
        return self.futures[-1]

    def shutdown(self, wait=True, *, cancel_futures=False):
        self.ended.append((wait, cancel_futures))
        super().shutdown(wait, cancel_futures=cancel_futures)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), BrokenProcessPool("gone")])
def test_a_pool_whose_workers_may_be_dead_cancels_its_work_itself(error):
    # Before Python 3.12.1 its thread fails at a future that was cancelled elsewhere, and the program stays.
    with Unstarted(error) as pool:
        with pytest.raises(type(error)):
            eft.study(RIG, COMMAND, GRID, executor=pool, chunk=1)
        assert pool.ended == [(False, True)]
        assert len(pool.futures) > 1 and not any(future.cancelled() for future in pool.futures)


def test_what_is_no_executor_is_refused():
    with pytest.raises(TypeError, match=r"^executor = .*get_executor"):
        eft.study(RIG, COMMAND, GRID, executor=object())


def test_a_worker_of_another_version_is_an_error(monkeypatch):
    monkeypatch.setattr("eft._study._batch.__version__", "0.0.9")
    with pytest.raises(Exception, match=r"0\.0\.9 on the worker: must be"):
        eft.study(RIG, COMMAND, GRID, executor=Treacherous(set(), None))


def test_a_study_in_a_folder_needs_no_pandas_and_little_memory(tmp_path):
    script = tmp_path / "study.py"
    script.write_text(
        textwrap.dedent("""
        import resource, sys, eft
        command = eft.sine_sweep(amplitude=8900.0, f_start=0.5, f_end=4.0, duration=2.0, sample_rate=1024.0)
        def run(n):
            levels = [0.5 + i / 10000 for i in range(n)]
            folder = f"{sys.argv[1]}/{n}"
            eft.study(eft.Rig.zhao2005(), command, {"compensation.level": levels}, output=folder, chunk=16)
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        few = run(32)
        print(few, run(160), "pandas" in sys.modules)
    """)
    )
    done = subprocess.run(
        [sys.executable, script, tmp_path], check=True, timeout=120, capture_output=True, text=True
    )
    few, many, pandas = map(ast.literal_eval, done.stdout.split())
    assert pandas is False
    # 128 more runs of 2048 samples and 18 traces would be 37 MB.
    assert many - few < 20_000, (few, many)

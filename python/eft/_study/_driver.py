"""Runs a study, here or on the workers of an executor."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any

from eft._memory import StudyMemory, warn_of_memory
from eft._native import Command, Rig, check_rig
from eft._run import Dtype
from eft._study._batch import run_batch
from eft._study._combinations import combinations_of
from eft._study._plan import Batch, Plan, StructureMaker
from eft._study._result import Study
from eft._study._rows import Outcome, WrongVersionError, columns, failed_row
from eft._study._samplers import Sampler
from eft._study._store import Folder, Memory

_PARTS = 256
"""Approximate number of chunks of a study: enough for every worker, with few files."""
_LEAST = 32
"""Least number of tests per chunk, because each chunk has an overhead."""
_IN_FLIGHT = 128
"""Number of chunks that an executor holds at once; more would only use memory."""


def study(
    rig: Rig,
    command: Command | Mapping[str, Command],
    parameters: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]] | Sampler,
    *,
    executor: Executor | None = None,
    output: str | PathLike[str] | None = None,
    dtype: Dtype = "f64",
    traces: bool = False,
    fft: bool = True,
    chunk: int | None = None,
    structure: StructureMaker | None = None,
    progress: bool | Callable[[int, int], object] | None = None,
) -> Study:
    """Run and judge a test for every combination of settings, with one row per test.

    Parameters
    ----------
    rig : Rig
        The rig on which the settings are changed.
    command : Command or mapping of names to commands
        The force to be applied. With several commands every combination runs under each.
    parameters : mapping, list of mappings, or sampler
        Dotted keys of the rig with lists of values, for every combination of them. Or a list of single
        combinations. Or `LatinHypercube` or `Sobol`. The key ``command.scale`` is a factor on the command.
        Numbers are in SI units. Texts have their unit, such as ``"7 t"``, and the rows have the SI value.
    executor : concurrent.futures.Executor, optional
        The executor of the tests, such as a process pool or ``Client.get_executor()`` of Dask distributed.
        Without one, the tests run on all cores of this machine. The rows are the same. Ctrl-C ends a process
        pool.
    output : str or os.PathLike, optional
        A folder for the rows, as Parquet (needs pyarrow). If it holds the beginning of the same study, the
        study resumes. A kill at any moment loses at most the running chunks. Without a folder the rows stay
        in memory.
    dtype : {"f64", "f32"}
        Precision of the controller.
    traces : bool
        Keep the traces of every test, in memory or in the folder: see `Study.run`.
    fft : bool
        Whether to compute the metrics that need a Fourier transform, such as the delay. They take longer than
        a test. Otherwise their columns stay empty.
    chunk : int, optional
        Number of tests that are sent and written together.
    structure : callable, optional
        Makes the external structure for `simulate`; it is called once a test with its rig. Such tests run one
        after another here, or in the processes of an executor, which must be able to pickle it. An exception
        of maker or structure is the reason in its test's row.
    progress : bool or callable, optional
        A bar with the remaining time; None shows it only on a terminal. Or a function, called with the number
        of finished tests and their total.

    Returns
    -------
    Study
        The rows in the order of the combinations.

    Raises
    ------
    ValueError
        If a key is unknown, a value has a wrong type, or the folder contains another study. If the tests that
        run at once, and the traces that are kept, need more memory than this machine has. A value that the
        rig refuses is not an error; its row has the reason.
    TypeError
        If `executor` is no ``concurrent.futures.Executor``, for example a client of Dask.

    Warns
    -----
    MemoryUseWarning
        If they need more than 2 GiB.

    Examples
    --------
    >>> import eft
    >>> command = eft.sine_sweep(2000.0, 0.0, 5.0, duration=2.0, sample_rate=1024.0)
    >>> levels = {"compensation.level": [0.9, 1.0]}
    >>> found = eft.study(eft.Rig.zhao2005(), command, levels, progress=False)
    >>> found.row(0)["nrmse"] > found.row(1)["nrmse"]
    True
    """
    check_rig(rig)
    commands = _commands(command)
    combinations = combinations_of(parameters, rig)
    total = len(commands) * len(combinations)
    longest = max(map(len, commands.values()))
    if chunk is None:
        chunk = chunk_of(total)
    elif not isinstance(chunk, int) or isinstance(chunk, bool) or chunk < 1:
        raise ValueError(f"chunk = {chunk!r}: must be a whole number of at least 1")
    if dtype not in ("f32", "f64"):
        raise ValueError(f'dtype = {dtype!r}: must be "f32" or "f64"')
    if executor is not None and not isinstance(executor, Executor):
        raise TypeError(
            f"executor = {executor!r}: must be a concurrent.futures.Executor; that of a Dask client is "
            "`client.get_executor()`"
        )
    if structure is not None and not callable(structure):
        raise ValueError(f"structure = {structure!r}: must be callable as structure(rig)")
    if structure is not None and isinstance(executor, ProcessPoolExecutor):
        try:
            pickle.dumps(structure)
        except Exception as error:
            allowed = f"must be a function of a module, which the processes can import: {error}"
            raise ValueError(f"structure = {structure!r}: {allowed}") from None
    # An executor of another library has its workers on machines that are unknown here.
    workers = None if executor is None else getattr(executor, "_max_workers", 1)
    in_folder, wide = output is not None, structure is None
    memory = StudyMemory.of(
        total, longest, chunk, traces=traces, folder=in_folder, workers=workers, wide=wide
    )
    warn_of_memory(f"command: {memory}", memory.needed(rig), _less(traces, in_folder))
    plan = Plan(rig, commands, combinations, dtype, traces, fft, chunk, structure)
    table = columns(combinations.keys, rig)
    with ExitStack() as stack:
        store: Folder | Memory = Memory(table)
        done: Sequence[int] = ()
        if output is not None:
            store = Folder(Path(output))
            stack.enter_context(store.locked())
            chunk = store.begin(plan.describe(), table, chunk)
            plan = Plan(rig, commands, combinations, dtype, traces, fft, chunk, structure)
            done = store.complete()
        update = stack.enter_context(_Progress(progress, sum(map(plan.size, done)), len(plan)))
        todo = sorted(set(range(plan.chunks)) - set(done))
        for number, outcomes in _run(plan, todo, executor):
            store.put(number, outcomes)
            update(plan.size(number))
    return Study(plan.describe(), table, chunk, store)


def chunk_of(tests: int) -> int:
    """Number of tests that a study of so many sends and writes together."""
    return max(_LEAST, -(-tests // (_PARTS * _LEAST)) * _LEAST)


def _less(traces: bool, folder: bool) -> str:
    """How a study takes less memory."""
    ways = ["shorten the command", "sample less often"]
    if traces:
        ways += ["leave out `traces`"] + (
            ["take a smaller `chunk`"] if folder else ["name a folder as `output`"]
        )
    return f"{', '.join(ways[:-1])} or {ways[-1]}"


def _commands(command: Command | Mapping[str, Command]) -> dict[str, Command]:
    commands = {"command": command} if isinstance(command, Command) else command
    if not isinstance(commands, Mapping) or not commands:
        raise ValueError(f"command = {command!r}: must be a Command, or names with their Commands")
    for name, value in commands.items():
        if not isinstance(name, str) or not isinstance(value, Command):
            raise ValueError(f"command[{name!r}] = {value!r}: must be a name with its Command")
    return dict(commands)


def _run(plan: Plan, todo: Iterable[int], executor: Executor | None) -> Iterator[tuple[int, list[Outcome]]]:
    """Chunks with their outcomes, as they finish."""
    if executor is None:
        for number in todo:
            yield number, run_batch(plan.batch(number))
        return
    waiting = iter(todo)
    flying: dict[Future[list[Outcome]], int] = {}
    try:
        while True:
            for number in islice(waiting, _IN_FLIGHT - len(flying)):
                flying[executor.submit(run_batch, plan.batch(number), 1)] = number
            if not flying:
                return
            # Finished chunks first, so that they are kept if another one ends the study.
            done = wait(flying, return_when=FIRST_COMPLETED).done
            for future in sorted(done, key=_broke):
                number = flying.pop(future)
                yield number, _result(future, plan.batch(number), executor)
    except (KeyboardInterrupt, BrokenProcessPool):
        # The interrupt kills workers that wait for work. Before Python 3.12.1 the thread of a broken pool
        # fails at a future that was cancelled here, and the other workers then wait for ever.
        if isinstance(executor, ProcessPoolExecutor):
            executor.shutdown(wait=False, cancel_futures=True)
            flying.clear()
        raise
    finally:
        for future in flying:
            future.cancel()


def _broke(future: Future[list[Outcome]]) -> bool:
    return future.cancelled() or future.exception() is not None


def _result(future: Future[list[Outcome]], batch: Batch, executor: Executor) -> list[Outcome]:
    """The results of a chunk; if its worker crashed, each of its tests runs again alone."""
    try:
        return future.result()
    except (BrokenExecutor, CancelledError, WrongVersionError):
        raise
    except Exception as error:
        if len(batch.tests) == 1:
            return [Outcome(failed_row(batch.tests[0], "failed", error), None)]
    alone = [(executor.submit(run_batch, single, 1), single) for single in batch.alone()]
    return [outcome for lone, single in alone for outcome in _result(lone, single, executor)]


class _Progress:
    """A progress bar, a callback, or neither."""

    def __init__(self, wanted: bool | Callable[[int, int], object] | None, done: int, total: int) -> None:
        from tqdm import tqdm

        self._call = wanted if callable(wanted) else None
        self._done, self._total = done, total
        hidden = None if wanted is None else wanted is not True
        self._bar = tqdm(desc="study", total=total, initial=done, unit="test", disable=hidden)

    def __enter__(self) -> Callable[[int], None]:
        return self._update

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def _update(self, more: int) -> None:
        self._done += more
        self._bar.update(more)
        if self._call is not None:
            self._call(self._done, self._total)

"""A study that was run, or the finished part of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eft._extras import need
from eft._native import Rig
from eft._numbers import whole_number
from eft._run import TestRun
from eft._study._rows import Column
from eft._study._store import Folder, Store
from eft._study._values import SCALE

if TYPE_CHECKING:
    import pandas as pd

_DTYPES = {"int": np.int64, "flags": np.uint32, "float": np.float64}


class Study:
    """The table of a study: one row per test.

    ``study["nrmse"]`` is a column as an array. Iteration gives the rows as dictionaries, and `to_pandas` the
    whole table. Undefined numbers are NaN in arrays and None in rows. A study in a folder is read from the
    files each time, so it uses little memory.
    """

    def __init__(
        self, description: Mapping[str, Any], table: Sequence[Column], chunk: int, store: Store
    ) -> None:
        self._description = description
        self._columns = {column.name: column for column in table}
        self._chunk = chunk
        self._store = store

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Study:
        """Read the folder of a study, finished or not (needs pyarrow).

        Parameters
        ----------
        path : path-like
            The folder.

        Returns
        -------
        Study

        Raises
        ------
        ValueError
            If it is not a study, is damaged, or has a later format.

        Examples
        --------
        >>> import eft
        >>> sweep, levels = eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0), {"compensation.level": [0.9, 1.0]}
        >>> study = eft.study(eft.Rig.zhao2005(), sweep, levels, output="level.study")
        >>> len(eft.Study.load("level.study"))
        2
        """
        store, about = Folder.open(Path(path))
        table = [Column(**column) for column in about["columns"]]
        return cls(about["study"], table, int(about["chunk"]), store)

    @property
    def path(self) -> Path | None:
        """Its folder, if it has one."""
        return self._store.path if isinstance(self._store, Folder) else None

    @property
    def description(self) -> Mapping[str, Any]:
        """Version, rig, commands, parameters and seed, as plain data."""
        return self._description

    @property
    def columns(self) -> tuple[Column, ...]:
        """Name, type, unit and meaning of every column."""
        return tuple(self._columns.values())

    @property
    def parameters(self) -> tuple[str, ...]:
        """The keys that were varied."""
        return tuple(self._description["parameters"]["order"])

    @property
    def tests(self) -> int:
        """Number of tests of the study, finished or not."""
        return int(self._description["tests"])

    @property
    def complete(self) -> bool:
        """Whether every test has its row."""
        return len(self) == self.tests

    def __len__(self) -> int:
        """Number of finished rows."""
        return sum(min(self._chunk, self.tests - number * self._chunk) for number in self._store.numbers())

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._columns:
            raise KeyError(f"no column {name!r}; there are {', '.join(self._columns)}")
        values: list[Any] = []
        for number in self._store.numbers():
            values += self._store.read(number, [name])[name]
        kind = self._columns[name].type
        if kind in ("int", "bool") and None in values:
            kind = "float"
        if kind == "bool":
            return np.array(values, dtype=np.bool_)
        if kind in _DTYPES:
            return np.array([np.nan if v is None else v for v in values], dtype=_DTYPES[kind])
        whole = np.empty(len(values), dtype=object)
        whole[:] = values
        return whole

    def __iter__(self) -> Iterator[dict[str, Any]]:
        for number in self._store.numbers():
            columns = self._store.read(number)
            for values in zip(*columns.values(), strict=True):
                yield dict(zip(columns, values, strict=True))

    def row(self, index: int) -> dict[str, Any]:
        """The row of one test.

        Parameters
        ----------
        index : int
            Number of the test, from 0.

        Returns
        -------
        dict
            Values by the names of the columns.

        Raises
        ------
        IndexError
            If there is no such test, or it has not run yet.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0)
        >>> study = eft.study(eft.Rig.zhao2005(), sweep, {"compensation.level": [0.9, 1.0]})
        >>> study.row(1)["compensation.level"], study.row(1)["status"]
        (1.0, 'completed')
        """
        if not 0 <= whole_number("index", index) < self.tests:
            raise IndexError(f"index = {index}: must be from 0 to {self.tests - 1}")
        number, place = divmod(index, self._chunk)
        if number not in self._store.numbers():
            raise IndexError(f"index = {index}: that test was not run yet")
        return {name: values[place] for name, values in self._store.read(number).items()}

    def rig(self, index: int) -> Rig:
        """The rig of one test.

        Parameters
        ----------
        index : int
            Number of the test, from 0.

        Returns
        -------
        Rig

        Raises
        ------
        IndexError
            If there is no such test, or it has not run yet.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0)
        >>> study = eft.study(eft.Rig.zhao2005(), sweep, {"compensation.level": [0.9, 1.0]})
        >>> study.rig(0)["compensation.level"]
        0.9
        """
        row = self.row(index)
        changes = {key: row[key] for key in self.parameters if key != SCALE}
        return Rig.from_dict(self._description["rig"]).replace(changes)

    def run(self, index: int) -> TestRun:
        """The traces of one test.

        Parameters
        ----------
        index : int
            Number of the test, from 0.

        Returns
        -------
        TestRun

        Raises
        ------
        IndexError
            If there is no such test, or it has not run yet.
        ValueError
            If the study kept no traces, or if this test has none because it was refused or failed.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0)
        >>> study = eft.study(eft.Rig.zhao2005(), sweep, {"compensation.level": [0.9, 1.0]}, traces=True)
        >>> len(study.run(0))
        2048
        """
        row = self.row(index)
        if not self._description["traces"]:
            raise ValueError(
                "the study kept no traces: run it with traces=True, or simulate study.rig(index) again"
            )
        if row["status"] in ("refused", "failed"):
            raise ValueError(f"test {index} has no traces: {row['error']}")
        return self._store.run(index)

    def to_pandas(self) -> pd.DataFrame:
        """Return the table as a data frame (needs pandas).

        Returns
        -------
        pandas.DataFrame
            One row for each test that has run.

        Raises
        ------
        ModuleNotFoundError
            If pandas is not installed.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0)
        >>> study = eft.study(eft.Rig.zhao2005(), sweep, {"compensation.level": [0.9, 1.0]})
        >>> study.to_pandas()["compensation.level"].tolist()
        [0.9, 1.0]
        """
        need("pandas")
        import pandas as pd

        return pd.DataFrame({name: self[name] for name in self._columns})

    def count(self) -> dict[str, int]:
        """Number of tests with each status.

        Returns
        -------
        dict
            Numbers by status.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0)
        >>> study = eft.study(eft.Rig.zhao2005(), sweep, {"compensation.level": [0.9, 1.0]})
        >>> study.count()
        {'completed': 2}
        """
        words, numbers = np.unique(self["status"].astype(str), return_counts=True)
        return {str(word): int(number) for word, number in zip(words, numbers, strict=True)}

    def plot(self, **options: Any) -> Any:
        """Draw a metric over each setting: `eft.plots.study`.

        Parameters
        ----------
        **options
            Those of `eft.plots.study`.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        TypeError
            If there is no such option.

        Examples
        --------
        >>> import eft
        >>> sweep = eft.sine_sweep(2000.0, 0.5, 5.0, 2.0, 1024.0)
        >>> study = eft.study(eft.Rig.zhao2005(), sweep, {"compensation.level": [0.9, 1.0]})
        >>> figure = study.plot(metric="max_spool")
        """
        from eft import plots

        return plots.study(self, **options)

    def _repr_html_(self) -> str:
        from eft import _notebook, plots

        if not len(self):
            return _notebook.shown("Study", [("tests", self.tests), ("rows", 0)])
        height = 2.0 * max(len(self.parameters), 1)
        rows = [("tests", self.tests), *self.count().items()]
        return _notebook.shown("Study", rows, lambda figure: plots.study(self, figure=figure), height)

    def __repr__(self) -> str:
        told = ", ".join(f"{number} {word}" for word, number in self.count().items())
        rest = "" if self.complete else f", {self.tests - len(self)} to come"
        return f"<eft.Study over {', '.join(self.parameters) or 'commands'}: {told or 'no rows'}{rest}>"

"""Checks of the files of a study from outside: its description and its rows."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from eft._extras import need
from eft._finding import GRADES
from eft._foreign import Budget, WrongFileError, check_unpacked, ordinary_size, understood
from eft._study._combinations import MOST
from eft._study._plan import FORMAT
from eft._study._rows import Column
from eft._table import METRICS

_LATER = ("displacement_error", "drift", "min_supply_pressure", "oscillation")
"""Metrics that older studies do not have."""
_NEEDED = {
    "index": "int", "command": "str", "status": "str", "flags": "flags", "samples": "int", "error": "str",
    **{name: "float" for name in METRICS if name not in _LATER},
}  # fmt: skip
"""Columns of every study with their types."""
_TYPES = ("int", "flags", "float", "bool", "str", "list")


def checked_about(file: Path, about: Any) -> dict[str, Any]:
    """The description of a study, if this version can read it."""
    with understood(file, "damaged"):
        _must(isinstance(about, dict), "must be a JSON object")
        _whole(about, "format", 1, 10**9)
        if about["format"] > FORMAT:
            raise WrongFileError(
                f"{file.parent}: format {about['format']} is later than {FORMAT}, "
                "the latest this version of eft reads"
            )
        _whole(about, "chunk", 1, MOST)
        _typed(about, {"configuration": str, "study": dict, "columns": list})
        study = about["study"]
        _whole(study, "tests", 1, MOST)
        _typed(study, {"version": str, "rig": dict, "commands": dict, "parameters": dict, "traces": bool})
        _must(study["dtype"] in ("f32", "f64"), "dtype must be f32 or f64")
        for one in study["commands"].values():
            _typed(one, {"samples": int, "sample_rate": float, "sha256": str})
        _parameters(study["parameters"])
        _columns(about["columns"], study["parameters"]["order"])
    checked: dict[str, Any] = about
    return checked


def _parameters(parameters: dict[str, Any]) -> None:
    _typed(parameters, {"kind": str, "order": list})
    _must(all(isinstance(key, str) for key in parameters["order"]), "order must hold names")
    _must(isinstance(parameters.get("seed", 0), int), "seed must be a whole number")
    values = parameters.get("values", {})
    _must(isinstance(values, dict), "values must be an object")
    for value in values.values():
        if isinstance(value, dict):
            _must(
                all(_is_number(value.get(bound)) for bound in ("low", "high")), "low and high must be numbers"
            )
            _typed(value, {"log": bool})
        else:
            _must(isinstance(value, list), "values must be lists or ranges")


def _columns(columns: list[Any], order: list[str]) -> None:
    for column in columns:
        _typed(column, dict.fromkeys(Column._fields, str))
        _must(len(column) == len(Column._fields), "a column must have a name, a type, a unit and a meaning")
        _must(column["type"] in _TYPES, f"type {column['type']!r} must be one of {', '.join(_TYPES)}")
    types = {column["name"]: column["type"] for column in columns}
    _must(len(types) == len(columns), "columns must have different names")
    for name, kind in _NEEDED.items():
        _must(types.get(name) == kind, f"column {name} must be there, of type {kind}")
    _must(set(order) <= set(types), "every parameter must have its column")


def _typed(tree: Any, types: Mapping[str, type]) -> None:
    _must(isinstance(tree, dict), "must be a JSON object")
    for name, wanted in types.items():
        good = _is_number(tree[name]) if wanted is float else isinstance(tree[name], wanted)
        _must(good, f"{name} must be of type {wanted.__name__}")


def _whole(tree: dict[str, Any], name: str, low: int, high: int) -> None:
    value = tree[name]
    good = isinstance(value, int) and not isinstance(value, bool) and low <= value <= high
    _must(good, f"{name} must be a whole number from {low} to {high}")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _must(good: bool, message: str) -> None:
    if not good:
        raise ValueError(message)


def read_part(part: Path, schema: Any, tests: range, names: Sequence[str] | None) -> dict[str, list[Any]]:
    """The rows of the tests of a chunk by columns, if they are those of the study."""
    need("pyarrow", "study")
    import pyarrow as pa
    import pyarrow.parquet

    budget = Budget(part)
    wanted = [schema.field(name) for name in (schema.names if names is None else names)]
    # A text shared by many rows is stored once.
    texts = [field.name for field in schema if field.type == pa.string()]
    lists = [place for place, field in enumerate(schema) if pa.types.is_list(field.type)]
    with (
        understood(part, "damaged; remove it, and the study computes its rows again"),
        pyarrow.parquet.ParquetFile(part, memory_map=True, read_dictionary=texts) as file,
    ):
        rows = len(tests)
        if file.metadata.num_rows != rows:
            raise ValueError(f"{file.metadata.num_rows} rows, must be {rows}")
        if file.schema_arrow.names != schema.names:
            raise ValueError("its columns are not those of the study")
        about = file.schema_arrow.metadata or {}
        if about.get(b"eft.configuration") != schema.metadata[b"eft.configuration"]:
            raise ValueError("its rows are of another study")
        index = file.metadata.row_group(0).column(schema.get_field_index("index")).statistics
        if index is not None and index.has_min_max and index.min != tests[0]:
            raise ValueError(f"begins with test {index.min}, must begin with {tests[0]}")
        for field in wanted:
            found = file.schema_arrow.field(field.name).type
            if pa.types.is_dictionary(found):
                found = found.value_type
            if found != field.type:
                raise ValueError(f"column {field.name} is of {found}, must be of {field.type}")
        check_unpacked(file.metadata, ordinary_size(part))
        budget.take(8 * rows * len(wanted))
        for group in map(file.metadata.row_group, range(file.metadata.num_row_groups)):
            for place in lists:
                budget.take(8 * group.column(place).num_values)
        table = file.read(columns=[field.name for field in wanted])
        columns = {name: _listed(table[name]) for name in table.column_names}
        if unknown := set(columns.get("verdict", [])) - {*GRADES, None}:
            shown = reprlib.repr(min(unknown))
            raise ValueError(f"column verdict has {shown}, must be one of {', '.join(GRADES)}")
        return columns


def _listed(column: Any) -> list[Any]:
    values: list[Any] = []
    for chunk in column.chunks:
        if hasattr(chunk, "dictionary"):
            texts = chunk.dictionary.to_pylist()
            values += [None if place is None else texts[place] for place in chunk.indices.to_pylist()]
        else:
            values += chunk.to_pylist()
    return values

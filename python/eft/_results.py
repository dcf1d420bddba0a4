"""Common base of the results."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import fields
from typing import TYPE_CHECKING, Any


class Result:
    """A frozen result with named fields."""

    def _repr_html_(self) -> str:
        from eft import _notebook

        rows = [(field.name.replace("_", " "), _shown(getattr(self, field.name))) for field in fields(self)]  # type: ignore[arg-type]
        return _notebook.shown(type(self).__name__, rows)

    if not TYPE_CHECKING:
        # Dictionary access works for one more release, because these results were dictionaries.

        def __getitem__(self, name: str) -> Any:
            _warn(type(self).__name__, name)
            if name not in self.keys():
                raise KeyError(name)
            return getattr(self, name)

        def __contains__(self, name: object) -> bool:
            _warn(type(self).__name__, name)
            return name in self.keys()

        def __iter__(self) -> Iterator[str]:
            return iter(self.keys())

        def keys(self) -> list[str]:
            """Names of the fields that have a value."""
            return [field.name for field in fields(self) if getattr(self, field.name) is not None]


def _shown(value: Any) -> str:
    """A field in few words; the results of a list follow one another."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, tuple):
        return "; ".join(_shown(one) for one in value) or "nothing"
    return str(value)


def _warn(what: str, name: object) -> None:
    text = f"a {what} is no longer a dictionary: write .{name} instead of [{name!r}]"
    warnings.warn(text, DeprecationWarning, stacklevel=3)

"""What all results share: words, JSON, and properties that are computed once."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from ._restored import Restored, said

Array = npt.NDArray[np.float64]
T = TypeVar("T")


class once(Generic[T]):
    """A property that is computed once and cannot be changed: tables are given as copies, arrays are read-only."""

    def __init__(self, function: Callable[[Any], T]) -> None:
        self._function = function
        self.__doc__ = function.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = f"_once_{name}"

    def __get__(self, result: Any, owner: type | None = None) -> T:
        if result is None:
            return self  # type: ignore[return-value]
        kept = result.__dict__
        if self._name not in kept:
            value = self._function(result)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            kept[self._name] = value
        value = kept[self._name]
        copy = getattr(value, "copy", None)
        return copy() if copy is not None and hasattr(value, "columns") else value  # type: ignore[no-any-return]

    def __set__(self, result: Any, value: object) -> None:
        raise AttributeError(f"{self._name.removeprefix('_once_')}: results cannot be changed")


class Result:
    """What all results can do."""

    _core: Any

    def __setattr__(self, name: str, value: object) -> None:
        if not name.startswith("_"):
            raise AttributeError(f"{name}: results cannot be changed")
        super().__setattr__(name, value)

    def __getstate__(self) -> dict[str, Any]:
        return {"said": said(self._core)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._core = Restored(state["said"], None)

    def summary(self) -> str:
        """What the command line prints (``identify``, ``loop`` and ``check`` with ``-v``), as text."""
        return str(self._core.summary())

    def to_json(self) -> str:
        """The file that the command line writes (``estimate.json``, ``loop.json`` …), to the byte but for the time taken."""
        return self._json

    def to_dict(self) -> dict[str, Any]:
        """The same as a dict; docs/results.md explains every field. SI units, except where a key says otherwise."""
        document: dict[str, Any] = json.loads(self._json)
        return document

    @once
    def _json(self) -> str:
        return str(self._core.json())

    @once
    def _document(self) -> dict[str, Any]:
        return self.to_dict()

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        return f"<flexcal.{type(self).__name__} of {self._document['problem']!r}>"

"""Mean and spread of the parameters of several arms of one type."""

from __future__ import annotations

import json
import pathlib
from collections.abc import Iterable
from os import PathLike
from typing import Any

from . import _core


def fleet(estimates: Iterable[str | PathLike[str]], out: str | PathLike[str] | None = None) -> dict[str, Any]:
    """Finds mean and spread of the parameters of several arms of one type (docs/life.md).

    Parameters
    ----------
    estimates
        Paths of the ``estimate.json`` of at least three arms with the same declaration.
    out
        File to write: a ``PRIOR.toml`` that ``flexcal identify --prior`` takes.

    Returns
    -------
    ``parameters`` with ``mean``, ``mean_error`` and ``spread``, and ``arms`` with ``unlike``.

    Raises
    ------
    InputError
        Too few arms, or arms that differ in their declaration.
    """
    text, prior = _core.fleet([pathlib.Path(path) for path in estimates])
    if out is not None:
        pathlib.Path(out).write_text(prior, encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found

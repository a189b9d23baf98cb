"""Mean and spread of the parameters of several arms of one type."""

from __future__ import annotations

import json
import pathlib
from collections.abc import Iterable
from os import PathLike
from typing import Any

from . import _core
from ._fits import ClosedLoop, Identification, estimate


def fleet(estimates: Iterable[str | PathLike[str] | Identification | ClosedLoop], out: str | PathLike[str] | None = None) -> dict[str, Any]:
    """Finds mean and spread of the parameters of several arms of one type (docs/life.md).

    Parameters
    ----------
    estimates
        At least three arms with the same declaration: identifications, loops (of which the last fit counts), or paths of their
        ``estimate.json``, which :meth:`Identification.to_json` gives.
    out
        File to write: a ``PRIOR.toml`` that ``flexcal identify --prior`` takes.

    Returns
    -------
    ``fleet.json`` of the command line as a dict: ``parameters``, a dict each with ``mean``, ``mean_error`` and ``spread``, and ``arms``
    with ``unlike`` (docs/schema/fleet.schema.json lists every key).

    Raises
    ------
    InputError
        Too few arms, or arms that differ in their declaration.
    """
    if isinstance(estimates, (str, PathLike, Identification, ClosedLoop)):
        raise TypeError("estimates: a list of at least three arms is needed, not a single one")
    text, prior = _core.fleet([estimate(arm, f"estimate {k}") for k, arm in enumerate(estimates, 1)])
    if out is not None:
        pathlib.Path(out).write_text(prior, encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found

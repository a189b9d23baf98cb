"""How far a fit has come."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple, TypeAlias

PATIENCE = 0.5
"""A fit faster than this shows nothing [s]."""


class Progress(NamedTuple):
    """A step of a fit; a loop makes many fits."""

    iteration: int
    """Steps tried in the fit at hand."""
    unknowns: int
    """Number of unknowns of the fit at hand."""
    poses: int
    """Number of poses of the fit at hand."""
    cost: float
    """Half the sum of squares of its whitened residuals."""


Told: TypeAlias = Callable[[Progress], object] | bool
"""Who is told of every step: a function, True (a line on standard error), or False (nobody)."""
Step: TypeAlias = Callable[[int, int, int, float], object]


@contextmanager
def told(progress: Told) -> Iterator[Step | None]:
    """What the extension module calls at every step."""
    if callable(progress):
        function = progress
        yield lambda *step: function(Progress(*step))
    elif not isinstance(progress, bool):
        raise TypeError(f"progress: a function, True or False is needed, not {progress!r}")
    elif progress:
        line = _Line()
        try:
            yield line.show
        finally:
            line.clear()
    else:
        yield None


class _Line:
    """A line on standard error that is written over and over."""

    def __init__(self) -> None:
        self.shown = time.monotonic() + PATIENCE - 0.1
        self.length = 0

    def show(self, iteration: int, unknowns: int, poses: int, cost: float) -> None:
        now = time.monotonic()
        if now - self.shown > 0.1:
            self.shown = now
            text = f"{poses} poses, {unknowns} parameters: step {iteration}, half the sum of squares {cost:.6e}"
            sys.stderr.write("\r" + text.ljust(self.length))
            sys.stderr.flush()
            self.length = len(text)

    def clear(self) -> None:
        if self.length:
            sys.stderr.write("\r" + " " * self.length + "\r")
            sys.stderr.flush()

"""Results as they are pickled and copied: what they say, and how they are calculated again."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from ._tables import Source

if TYPE_CHECKING:
    from ._problem import Problem

Sibling: TypeAlias = "str | tuple[str, str]"
"""An estimate as the extension module takes it: a file, or the name and the text of one."""
Prior: TypeAlias = "str | tuple[str, str, str | None]"
"""A prior as the extension module takes it: a file, or the name and the text of an estimate and the text of its remainder."""


class Spec(NamedTuple):
    """The call that gave a result."""

    call: str
    problem: Problem
    data: Source
    strategy: str = "joint"
    solver: str = "auto"
    remainder: bool = False
    paper: bool = False
    prior: Prior | None = None
    drift_days: float = 0.0

    def part(self, name: str) -> Spec:
        """The call that gives a fit of the result, ``"before"`` or ``"after"`` a loop, the ``"fit"`` of a trace or the
        ``"joint"`` one of a comparison."""
        return self._replace(call=f"{self.call}.{name}")

    def calculate(self) -> Any:
        """The result of the extension module; the same to the last bit for the same data."""
        core = self.problem._core
        data = core.data(self.data)
        whole: Any
        call, _, part = self.call.partition(".")
        if call == "identify":
            return core.identify(data, self.strategy, self.solver, self.remainder, self.prior, self.drift_days, None)
        if call == "compare":
            whole = core.compare(data, self.paper, None)
        else:
            whole = core.close(data, None) if call == "loop" else core.trace(data, None)
        return getattr(whole, part)() if part else whole


class Restored:
    """What a result of the extension module said, and the result itself once more is asked of it."""

    def __init__(self, said: dict[str, Any], spec: Spec | None) -> None:
        self._said = said
        self._spec = spec

    @cached_property
    def _calculated(self) -> Any:
        if self._spec is None:
            raise TypeError("this part of a result is not kept in its pickle")
        return self._spec.calculate()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._said:
            return getattr(self._calculated, name)
        said = self._said[name]
        return (lambda: said) if name in METHODS else said


METHODS = ("json", "summary", "report", "covariance", "priors", "residuals", "closed_problem", "csv", "parameters_csv")
"""What the extension module says when it is called."""
PROPERTIES = ("why_not_trusted", "cautions", "doubted_bounds", "why_not_sufficient", "suffices", "text", "unused_split", "warnings")
"""What it says without a call."""


def said(core: Any) -> dict[str, Any]:
    """Everything that a result of the extension module says without arguments."""
    if isinstance(core, Restored):
        return dict(core._said)
    words = {name: getattr(core, name)() for name in METHODS if hasattr(core, name)}
    return words | {name: getattr(core, name) for name in PROPERTIES if hasattr(core, name)}

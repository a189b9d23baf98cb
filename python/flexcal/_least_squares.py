"""Residuals and their Jacobian by parameters as arrays, for SciPy and solvers of one's own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._tables import Source, _plain
from .errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from ._core import LeastSquares as Core
    from ._problem import Problem

Array = npt.NDArray[np.float64]


class LeastSquares:
    """Whitened residuals r(x) of the rows to be fitted and of the priors, as a function of the unknowns x.

    r = ((measured − predicted) / σ of every measured number, x / σ of every prior). ``problem.identify`` minimises ½ r·r unless a
    section ``[robust]`` asks for another loss. Rows without a σ of their own take ``position_sigma_mm``, or 1 mm.

    x holds deviations from nominal, one for each row of :attr:`unknowns`, in their order: angles [rad] and lengths [m] are differences,
    stiffnesses and rigidities ln(value / nominal), so that every real x is a valid arm. :meth:`values` and :meth:`deviations`
    convert.

    >>> fit = problem.least_squares()
    >>> found = scipy.optimize.least_squares(fit.residuals, fit.start, fit.jacobian, bounds=(fit.lower, fit.upper), x_scale="jac")
    >>> fit.values(found.x)
    """

    _core: Core
    _made_of: tuple[Problem, Source, str]

    def __init__(self, core: Core, problem: Problem, data: Source, strategy: str) -> None:
        object.__setattr__(self, "_core", core)
        object.__setattr__(self, "_made_of", (problem, data, strategy))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{name}: residuals cannot be changed")

    def __reduce__(self) -> tuple[object, ...]:
        return _made, self._made_of

    @property
    def unknowns(self) -> pd.DataFrame:
        """The unknowns, a row each, by the names of their parameters, in the order of x.

        Columns: ``unit`` and ``nominal`` of the value (SI); ``x_unit`` of the following (``"1"``: ln(value / nominal)); ``start`` (the
        nominal arm, with free bases and targets fitted), ``prior_sigma`` (NaN without a prior), ``lower``, ``upper``.
        """
        import pandas as pd

        names = ["name", "unit", "nominal", "x_unit", "start", "prior_sigma", "lower", "upper"]
        frame = pd.DataFrame(self._core.unknowns(), columns=names).set_index("name")
        return frame.astype({"prior_sigma": np.float64})

    @property
    def rows(self) -> pd.DataFrame:
        """Where each residual comes from: ``row`` of the data, from 0 (-1 for a prior), and ``of``, the number that it measures (``"x"``,
        ``"distance"``, ``"rx"`` …) or the parameter of the prior."""
        import pandas as pd

        origins = self._core.origins()
        columns = {"row": [-1 if row is None else row for row, _ in origins], "of": [name for _, name in origins]}
        return pd.DataFrame(columns)

    @property
    def start(self) -> Array:
        """x of the nominal arm, with free bases and targets fitted: where a fit starts."""
        return self.unknowns["start"].to_numpy(copy=True)

    @property
    def lower(self) -> Array:
        """Lower bounds on x; −∞ without one."""
        return self.unknowns["lower"].to_numpy(copy=True)

    @property
    def upper(self) -> Array:
        """Upper bounds on x; ∞ without one."""
        return self.unknowns["upper"].to_numpy(copy=True)

    def residuals(self, x: npt.ArrayLike) -> Array:
        """r(x), shape (residuals,), without unit; NaN in rows where the arm has no equilibrium."""
        return np.frombuffer(self._core.residuals(self._vector(x)), dtype=np.float64)

    def jacobian(self, x: npt.ArrayLike) -> Array:
        """∂r/∂x, shape (residuals, unknowns), by automatic and analytical derivatives."""
        vector = self._vector(x)
        return np.frombuffer(self._core.jacobian(vector), dtype=np.float64).reshape(-1, len(vector) // 8)

    def values(self, x: npt.ArrayLike) -> Array:
        """The values of the parameters at x, SI."""
        return np.frombuffer(self._core.values(self._vector(x)), dtype=np.float64)

    def deviations(self, values: npt.ArrayLike) -> Array:
        """x at which the parameters have these values, SI; the inverse of :meth:`values`."""
        return np.frombuffer(self._core.deviations(self._vector(values)), dtype=np.float64)

    def _vector(self, x: npt.ArrayLike) -> bytes:
        vector = _plain("x", x, "data")
        if vector.dtype.kind not in "fiu" or vector.ndim != 1 or not np.isfinite(vector).all():
            raise InputError(f"x: finite numbers of shape ({len(self._core.unknowns())},) are needed", key="x")
        return vector.astype(np.float64).tobytes()

    def __repr__(self) -> str:
        problem = self._made_of[0]
        return f"<flexcal.LeastSquares of {problem.name!r}, {len(self._core.unknowns())} unknowns>"


def _made(problem: Problem, data: Source, strategy: Any) -> LeastSquares:
    """Residuals from their pickle."""
    core = problem._core
    return LeastSquares(core.least_squares(core.data(data), strategy), problem, data, strategy)

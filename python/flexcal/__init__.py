"""Identify the geometric and elastic parameters of robot arms from measured end-point positions.

>>> import flexcal
>>> problem = flexcal.Problem("problems/lunar-sampler")
>>> result = problem.identify()
>>> result.parameters.loc["joint2.stiffness", ["nominal", "estimate", "std_error"]]
>>> loop = problem.loop()          # finds what the model lacks
>>> loop                           # in a notebook: headline, effects, figure

Lengths are in metres, angles in radian, everything else in SI units as well, except where the name of a column or key says
otherwise (``x_mm``, ``mean_mm``, ``temperature_C``).
"""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from ._applied import Compensation, Export
from ._designs import Check, Next, Plan, Simulation, Study
from ._fits import ClosedLoop, Comparison, HeldOutError, Identification, Trace
from ._fleet import fleet
from ._forward import Prediction
from ._least_squares import LeastSquares
from ._problem import Problem, study
from ._progress import Progress
from .errors import FlexcalWarning, InputError

try:
    __version__ = version("flexcal")
except PackageNotFoundError:  # imported from a folder that is not installed
    __version__ = "unknown"

__all__ = [
    "Check",
    "ClosedLoop",
    "Comparison",
    "Compensation",
    "Export",
    "FlexcalWarning",
    "HeldOutError",
    "Identification",
    "InputError",
    "LeastSquares",
    "Next",
    "Plan",
    "Prediction",
    "Problem",
    "Progress",
    "Simulation",
    "Study",
    "Trace",
    "fleet",
    "study",
]


OTHER_NAMES = {
    "calibrate": "identify",
    "fit": "identify",
    "estimate": "identify",
    "search": "loop",
    "read": "Problem",
    "load": "Problem",
    "open": "Problem",
}
"""Names that are often taken for functions of this module, with what is meant."""


# A type checker has to find what does not exist.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        meant = OTHER_NAMES.get(name, name)
        if meant == "Problem":
            hint = '; write flexcal.Problem("FOLDER")'
        elif not name.startswith("_") and hasattr(Problem, meant):
            hint = f"; it is a method of a problem: flexcal.Problem(\"FOLDER\").{meant}(…)"
        elif not name.startswith("_") and hasattr(Identification, meant):
            hint = f"; it belongs to an identified arm: flexcal.Problem(\"FOLDER\").identify().{meant}"
        else:
            hint = ""
        raise AttributeError(f"module 'flexcal' has no attribute {name!r}{hint}")

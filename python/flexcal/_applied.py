"""What an identified arm is used for: a calibrated URDF, and corrected commands."""

from __future__ import annotations

import pathlib
import tempfile
from typing import TYPE_CHECKING

from . import _html
from ._frames import error_row
from ._result import Result, once
from ._tables import Path, table

if TYPE_CHECKING:
    import pandas as pd

    from . import _core


class Export(Result):
    """A URDF with the origins of its chain moved, every other byte as it was."""

    def __init__(self, core: _core.Export) -> None:
        self._core = core

    @property
    def text(self) -> str:
        """The whole file."""
        return str(self._core.text)

    def write(self, file: Path) -> None:
        """Writes it: whole, or not at all. A folder that is missing is made."""
        file = pathlib.Path(file)
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent) as folder:
            whole = pathlib.Path(folder) / file.name
            whole.write_bytes(self.text.encode())
            whole.replace(file)

    @once
    def origins(self) -> pd.DataFrame:
        """The origins that have moved, by their joints: ``x_m`` …, ``roll_rad`` … as written, ``moved_mm``, ``turned_deg``."""
        import pandas as pd

        names = ["x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad", "moved_mm", "turned_deg"]
        entries = self._document["origins"]
        rows = [[*own["xyz_m"], *own["rpy_rad"], own["moved_mm"], own["turned_deg"]] for own in entries]
        return pd.DataFrame(rows, columns=names, index=pd.Index([own["joint"] for own in entries], name="joint"))

    @once
    def errors(self) -> pd.DataFrame:
        """Errors on the held-out rows, or on the fitted rows if none is held out (column ``rows``) [mm]: of the ``whole`` model, of the ``rigid`` geometry that the file holds, and of those that it
        could hold instead (``identified``, ``best_rigid``, ``fitted_alone``), unless they are the same; and of the ``nominal`` arm."""
        import pandas as pd

        rows = "held_out" if self._document["held_out"] is not None else "fitted"
        return pd.DataFrame([error_row(arm, own) | {"rows": rows} for arm, own in self._document[rows].items()]).set_index("arm")

    @property
    def not_held(self) -> list[str]:
        """What a URDF cannot hold of the model: stiffnesses, effects, base and target."""
        return list(self._document["not_held"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())


class Compensation(Result):
    """Commands that bring an identified arm to targets."""

    def __init__(self, core: _core.Compensation) -> None:
        self._core = core

    @once
    def commands(self) -> pd.DataFrame:
        """The commands, a row each, with the columns of ``commands.csv``: what the targets were called, ``q1_deg`` …, how far the arm
        stays from them (``miss_mm``), and the bound of the error."""
        return table(self._core.csv())

    @property
    def reached(self) -> bool:
        """Whether every target is reached."""
        return bool(self._document["reached"] == self._document["targets"])

    def _repr_html_(self) -> str:
        return _html.words(self.summary())

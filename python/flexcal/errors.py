"""What goes wrong, and what is only asked."""

from __future__ import annotations

import os


class InputError(ValueError):
    """A mistake in a problem, in measurements or in an argument; its text says what it is and how to mend it.

    Attributes
    ----------
    file
        The file, or ``"data"`` and ``"<text>"`` for tables and problems in memory; None where it is in no file.
    line
        Line of the file, counted from 1; of a table in memory the line that the row would have in a CSV file, where the
        header is line 1 and the first row line 2. None where it is not known.
    key
        Key of the problem (``"joint[2].alpha"``), column (``"column x_mm"``) or argument; None where it is not known.
    """

    file: str | None
    line: int | None
    key: str | None

    def __init__(
        self,
        message: str,
        file: str | os.PathLike[str] | None = None,
        line: int | None = None,
        key: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file = None if file is None else os.fspath(file)
        self.line = line
        self.key = key

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str | None, int | None, str | None]]:
        return type(self), (str(self), self.file, self.line, self.key)


class FlexcalWarning(UserWarning):
    """Something to look at: a column that was passed over, a fit that is not to be trusted."""

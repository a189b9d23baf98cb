"""The command line: ``flexcal …`` or ``python -m flexcal …``."""

from __future__ import annotations

import signal
import sys

from . import _core


def main() -> int:
    """Runs the command line with the arguments of the program; its exit status."""
    # No Python runs meanwhile that could turn an interrupt into an exception.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _core.command_line(["flexcal", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())

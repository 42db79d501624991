"""``python -m fotismos.reports`` is ``fotismos``."""

import os
import sys
from pathlib import Path

from fotismos.comparisons.processes import interruption
from fotismos.heuristic.program import VARIABLE


def main() -> None:
    """Run the command line, which a signal may end at any moment."""
    interruption.listen()
    _open_standard_streams()
    # Jupyter names a backend that need not be installed here; charts need none.
    os.environ["MPLBACKEND"] = "agg"
    # No file of ours holds a date, and libraries fail if this is not a number.
    os.environ.pop("SOURCE_DATE_EPOCH", None)
    if Path(sys.argv[0]).name == "__main__.py":
        os.environ.setdefault(VARIABLE, "python -m fotismos.reports")
    try:
        from fotismos.reports import cli  # a signal may also interrupt this import

        cli.main()
    except KeyboardInterrupt as error:
        sys.exit(interruption.code_of(error))


def _open_standard_streams() -> None:
    """Open closed standard streams to the null device, lest other files get their numbers."""
    for number in range(3):
        # A file that is opened now gets the first free number, which is the closed stream's.
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


if __name__ == "__main__":
    main()

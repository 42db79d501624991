"""``python -m reports`` is ``fotismos``."""

import sys

from comparisons import interruption


def main() -> None:
    """Run the command line, which signals may end at any moment."""
    interruption.listen()
    try:
        from reports import cli  # within reach of the signals

        cli.main()
    except KeyboardInterrupt as error:
        sys.exit(interruption.code_of(error))


if __name__ == "__main__":
    main()

"""``python -m reports`` is ``fotismos``."""

from reports.cli import main

if __name__ == "__main__":
    main()

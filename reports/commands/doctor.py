"""``fotismos doctor``: versions of the installation, and whether it renders."""

from fotismos.reports import jobs

TIMEOUT_S = 300
"""Seconds for a test rendering, which takes about ten if no kernel is compiled yet."""


@jobs.command()
def doctor() -> None:
    """Check the installation: versions, LLVM, OpenGL, a rendering in each variant, metrics.

    \b
    Examples:
      fotismos doctor
    """  # noqa: D301 click reads the \b as: keep these lines
    jobs.work("doctor", jobs.pool(TIMEOUT_S))

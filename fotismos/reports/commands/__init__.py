"""The commands of the command line, one module each.

A module imports Mitsuba and colour-science inside its function, so ``--help`` and usage errors
answer at once.
"""

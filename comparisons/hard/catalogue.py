"""All hard cases in one place, for the tests and the report.

Those of the group ``reference`` need a Mitsuba variant and the plugins.
"""

from comparisons.hard import colours, conventions, kernel, orientation, physical, surfaces

CASES = (
    *kernel.CASES,
    *orientation.CASES,
    *surfaces.CASES,
    *physical.CASES,
    *colours.CASES,
)

CONVENTIONS = conventions.CONVENTIONS

"""All hard cases in one place, for the tests and the report.

Those of the group ``reference`` need a Mitsuba variant and the plugins.
"""

from comparisons.hard import colour_values, conventions, kernel, orientation, physical, surfaces

CASES = (
    *kernel.CASES,
    *orientation.CASES,
    *surfaces.CASES,
    *physical.CASES,
    *colour_values.CASES,
)

CONVENTIONS = conventions.CONVENTIONS

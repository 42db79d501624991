"""All hard cases in one place, for the tests and the report."""

from comparisons.hard import colours, kernel, orientation, surfaces

CASES = (*kernel.CASES, *orientation.CASES, *surfaces.CASES, *colours.CASES)

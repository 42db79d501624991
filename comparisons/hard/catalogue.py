"""All hard cases in one place, for the tests and the report."""

from comparisons.hard import kernel, surfaces

CASES = (*kernel.CASES, *surfaces.CASES)

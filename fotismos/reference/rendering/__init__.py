"""Rendering in independent passes: integrators, sums, geometry."""

"""Regression checks: what a baseline kept is compared with what there is now, half by half."""

"""Regression checks: a scene measured anew, and held against what was measured once."""

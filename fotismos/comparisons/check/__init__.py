"""Regression checks: measure a scene again, and compare it with a baseline."""

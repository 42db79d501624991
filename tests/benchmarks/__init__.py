"""Benchmarks: they report times, and gate nothing. ``python -m tests.benchmarks [NAME]``."""

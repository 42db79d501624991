"""Faults of every kind, met by the command line as a user calls it.

``python -m tests.faults [KIND ...]`` prints the table of what came of them.
"""

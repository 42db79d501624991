"""Faults by kind: each module yields them from ``faults()``."""

"""Baselines, checks, and what CI services and pytest get."""

"""Paired scenes, metrics, and their results as plain records; nothing is printed."""

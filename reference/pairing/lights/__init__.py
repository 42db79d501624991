"""Lights, paired both ways."""

"""Tests of the comparisons room."""

"""Tests of the heuristic room."""

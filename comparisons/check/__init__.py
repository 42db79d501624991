"""Regression checks: a scene measured again, and compared with what was measured once."""

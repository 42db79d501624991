"""Equation 8.10 at a pixel, term by term, and the lobes of both materials."""

"""Predict the cost of methods at a size too large to try them all, from smaller sizes."""

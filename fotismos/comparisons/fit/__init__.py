"""Fitting the textbook model's parameters to the reference.

Is the model wrong, or only its parameters?
"""

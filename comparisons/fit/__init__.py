"""Fitting the heuristic model's parameters to the reference: is the model wrong, or only they?"""

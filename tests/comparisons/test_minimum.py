"""The bounded search for a minimum, against SciPy's."""

import numpy as np
from scipy.optimize import minimize_scalar

from fotismos.comparisons.departure.minimum import minimum


def test_the_search_takes_the_steps_of_scipys():
    """Smooth, broken, flat and stepped functions; with any minimum, at a bound or inside."""
    random = np.random.default_rng(0)
    for _ in range(40):
        a, b, c, low = random.normal(size=4)
        high = low + random.uniform(0.01, 4)
        functions = (
            lambda x, a=a, b=b, c=c: a * np.cos(3 * x + b) + np.sin(7 * c * x),
            lambda x, a=a: (x - a) ** 2,
            lambda x, a=a, b=b: np.exp(a * x) + abs(x - b),
            lambda x, a=a: a * x,
            lambda x: 1.0,
            lambda x, a=a, b=b: round(8 * x + a) * b,
        )
        for function in functions:
            for tolerance in (0.1, 1e-3, 1e-5):
                bounded = {"method": "bounded", "options": {"xatol": tolerance}}
                expected = minimize_scalar(function, bounds=(low, high), **bounded)
                found = minimum(function, low, high, tolerance)
                assert found == (expected.x, expected.fun)

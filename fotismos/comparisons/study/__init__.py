"""Studies: comparisons over a parameter space, each a row of one dataset.

A worker process of a cluster imports this package before anything else of fotismos.
"""

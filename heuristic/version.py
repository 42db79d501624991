"""The version of fotismos, in one place."""

__version__ = "0.1.0"

"""The version of fotismos, in one place."""

__version__ = "0.2.0"

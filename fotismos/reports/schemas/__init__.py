"""The published schemas, made from the records' types: ``python -m fotismos.reports.schemas``."""

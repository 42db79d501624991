"""The published schemas, made from the types of the records: ``python -m reports.schemas``."""

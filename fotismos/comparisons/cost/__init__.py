"""What accuracy costs in time: a ladder of methods, what effects remove and add."""

"""Hard cases: where textbook formulas, metrics and the reference break, and by how much."""

"""Files: who made them, layers, pictures."""

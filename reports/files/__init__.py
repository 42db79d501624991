"""Files: ownership, layers, pictures."""

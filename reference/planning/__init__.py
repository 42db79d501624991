"""What a scene calls for, and the cheapest reference that simulates it."""

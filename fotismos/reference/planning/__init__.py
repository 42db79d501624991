"""The effects that a scene needs, and the cheapest reference that simulates them."""

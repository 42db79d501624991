"""The departure, attributed to effects."""

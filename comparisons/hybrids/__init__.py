"""Images in which some effects are simulated, and what they say about the departure."""

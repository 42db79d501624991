"""The records and images that comparisons return; nothing here imports what makes them."""

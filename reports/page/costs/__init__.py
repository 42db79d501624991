"""What accuracy costs, on pages: all scenes, one study, and the pictures of its points."""

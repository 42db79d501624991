"""One run on disk: scenes, their results, what is kept and found again."""

"""The work of the commands: each is imported when its options are known."""

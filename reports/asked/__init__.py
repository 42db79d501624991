"""From the words of a command to scenes and options."""

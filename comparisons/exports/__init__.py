"""A scene for another program to render."""

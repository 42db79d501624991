"""Scenes as read by Mitsuba: files, graph, sensor and film."""

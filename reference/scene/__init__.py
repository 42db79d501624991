"""Scenes as Mitsuba reads them: files, graph, sensor and film."""

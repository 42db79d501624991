"""Paired scenes, metrics, and what follows from them: plain records, nothing printed."""

"""Shaders in GLSL: their text, OpenGL, and the heuristic that joins the two."""

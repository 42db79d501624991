"""Heuristics in GLSL, run by OpenGL 4.3.

A file ``FILE.glsl`` holds ``vec3 shade(Point point)``. Its text is put between declarations of the
record and a ``main`` (:mod:`heuristic.glsl.shader_text`), compiled in a context without a window
and called for arrays of points (:mod:`heuristic.glsl.shader_files`).
"""

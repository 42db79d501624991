"""Heuristics written in GLSL: OpenGL runs them on the points that Dr.Jit found.

A file ``FILE.glsl`` holds ``vec3 shade(Point point)``. Its text is put between declarations of the
record and a ``main`` (:mod:`heuristic.glsl.shader_text`), compiled in a context without a window
(:mod:`heuristic.glsl.gpu`), and called for arrays of points (:mod:`heuristic.glsl.shader_files`).
"""

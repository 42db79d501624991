"""three.js as a heuristic: the scene drawn by the real library, in a browser without a window.

The package is not part of this one: ``npm ci`` fetches the version in ``package-lock.json``, whose
integrity hash npm checks, and nothing is downloaded later. Chromium runs it, with SwiftShader where
there is no graphics card. :mod:`heuristic.three_js.three_heuristics` declares the heuristics,
:mod:`heuristic.three_js.three_scene` says a scene in three.js' terms, and
:mod:`heuristic.three_js.browser` draws it.
"""

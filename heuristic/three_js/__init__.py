"""three.js as a heuristic: the real library draws the scene, in a browser without a window.

three.js is not part of this package: ``npm ci`` fetches the version in ``package-lock.json``, whose
integrity hash npm checks, and nothing is downloaded later. Chromium runs it, with SwiftShader if
there is no graphics card. :mod:`heuristic.three_js.three_heuristics` declares the heuristics,
:mod:`heuristic.three_js.three_scene` translates a scene into three.js' terms, and
:mod:`heuristic.three_js.browser` draws it.
"""

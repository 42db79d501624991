"""Scenes as read by Mitsuba: files, graph, sensor and film. It loads Mitsuba, with a variant."""

from fotismos.heuristic import llvm  # isort: skip  it finds LLVM before Mitsuba loads Dr.Jit

import mitsuba as mi

if mi.variant() is None:
    llvm.check()
    mi.set_variant("llvm_ad_rgb")  # Mitsuba has no names before a variant is chosen

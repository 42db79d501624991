"""The pictures, tables and sentences of the documents, made by ``./run docs``."""

import fotismos  # noqa: F401  it finds LLVM before a module here imports Dr.Jit

"""Paired scenes, metrics, and their results as plain records; nothing is printed."""

if __name__ == "comparisons":
    raise ImportError("write `import fotismos.comparisons` in place of `import comparisons`")

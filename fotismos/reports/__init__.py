"""Files, pages and the command line. It reads records and renders nothing itself."""

if __name__ == "reports":
    raise ImportError("write `import fotismos.reports` in place of `import reports`")

"""Files, pages and the command line. It reads records and renders nothing itself."""

"""Files: layers, pictures, exports."""

"""Tests of the project as a whole: its door, documents, installation and style."""

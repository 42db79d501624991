"""The two halves of a scene, each derived from the other."""

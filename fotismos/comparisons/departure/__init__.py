"""The difference between the halves: metrics, statistics, marks, regions."""

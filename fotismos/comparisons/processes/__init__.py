"""Processes: where scenes are read and rendered, here or on a cluster, and signals to them."""

"""Whether one way to shade can be physical at all: furnace, reciprocity, horizon, gradients."""

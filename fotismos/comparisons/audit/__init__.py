"""Whether a shading model can be physical: furnace, reciprocity, horizon, gradients."""

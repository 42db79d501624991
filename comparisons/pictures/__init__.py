"""Pictures of other renderers in place of the heuristic half."""

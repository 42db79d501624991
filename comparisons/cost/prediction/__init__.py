"""What methods cost at a size that is too large to try them all, predicted from smaller ones."""

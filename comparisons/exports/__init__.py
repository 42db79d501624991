"""What another program needs to render the same scene."""

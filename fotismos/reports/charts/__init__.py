"""Charts for the page and for print."""

"""Reports to read: what was found in words, the same for a terminal and for a page."""

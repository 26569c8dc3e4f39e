"""Pages to read: a result as one self-contained HTML file."""

"""One posterior over all candidates of all families, with slight effects beside them."""

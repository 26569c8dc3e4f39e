"""One posterior over all candidates, with slight effects beside them."""

"""One posterior over all candidates, with slight effects in addition to them."""

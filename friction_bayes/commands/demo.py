"""``friction-bayes demo``."""
def add_parser(commands):
    pass

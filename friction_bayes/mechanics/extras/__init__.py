"""Effects that come with the package and are evaluated only where asked for, by ``--register``."""

from friction_bayes.mechanics.extras.intermediate_drag import INTERMEDIATE_DRAG

__all__ = ["INTERMEDIATE_DRAG"]

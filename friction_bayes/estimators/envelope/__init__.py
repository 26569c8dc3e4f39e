"""The method ``envelope``: conjugate regression on amplitude and centre of every half cycle."""

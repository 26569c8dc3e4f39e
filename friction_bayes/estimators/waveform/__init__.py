"""The method ``waveform``: conjugate regression on the whole signal."""

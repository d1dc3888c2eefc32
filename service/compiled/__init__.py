"""Compiled loops of the batches.  The folder counts as a source of the kernels' cache, see friction/compiled.py."""

"""Offline half: solves the full model, lays the blocks, writes and verifies the table."""

import friction as _friction  # noqa: F401 (first: it says where compiled kernels are cached)

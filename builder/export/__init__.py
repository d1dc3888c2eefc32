"""A table for other tools: C, FMU, a plain grid."""

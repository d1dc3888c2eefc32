"""Export a table for other tools: C, FMU, a plain grid."""

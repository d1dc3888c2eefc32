"""Hold the table: its file, its blocks, and the coordinates in which they are tabulated."""

"""The table as C: a translator of the library's scalar functions, and the header made of them and of a table."""

"""The table as C: a translator of the library's scalar functions, and the header that it makes of them and of a table."""

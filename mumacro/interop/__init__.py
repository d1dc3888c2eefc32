"""Containers of other libraries: each module loads its library only where it is used."""

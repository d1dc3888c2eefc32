"""The command ``mumacro``."""

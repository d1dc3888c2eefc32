"""Run the command ``mumacro``."""

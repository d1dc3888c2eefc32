"""Hold the version of the project.  The wheel, the tables and the service read it here."""

__version__ = "0.1.0"

"""The version of the project: the one place where it stands.  The wheel, the tables and the service read it here."""

__all__ = ["__version__"]

__version__ = "0.1.0"

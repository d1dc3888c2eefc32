"""Contacts beside the table: stiffness from materials, a ball's quadrature, the time domain."""

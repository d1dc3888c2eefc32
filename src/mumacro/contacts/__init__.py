"""Model contacts without the table: stiffness from materials, the quadrature of a ball, the time
domain."""

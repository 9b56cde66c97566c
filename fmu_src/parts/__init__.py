"""Parts of a drilling system: of each its equations, its variables, and the slave around it."""

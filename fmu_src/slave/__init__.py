"""What runs inside an FMU. Needs numpy and numba alone; pythonfmu comes along."""

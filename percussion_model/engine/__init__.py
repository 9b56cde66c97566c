"""Entries by which hosts call the solvers, and the library that holds them compiled."""

"""Kernels: numbers and records only."""

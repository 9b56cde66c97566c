"""Accuracy against time, hard cases, published measurements and the paper's statements."""

"""Accuracy against time, hard cases and the paper's statements."""

"""Accuracy against time, hard cases, measurements, the paper's statements."""

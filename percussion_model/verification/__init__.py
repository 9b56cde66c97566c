"""Accuracy, hard cases, measurements."""

"""Travelling waves in stepped bars."""

"""Section 4 of the paper repeated: drop tests, the stationary blow, and four sweeps."""

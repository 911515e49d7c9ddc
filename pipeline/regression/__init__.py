"""A run's figures held against a reference: what moved, from what to what, and what is allowed."""

"""Many runs: what there is and what it takes, what can be freed, what a make will cost."""

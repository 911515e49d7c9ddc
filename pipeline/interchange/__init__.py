"""The dataset in formats that grasp-learning code already loads: written, never read, by us."""

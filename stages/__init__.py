"""The six stages: each a short story, read artifacts → call pipeline → write an artifact."""

import pipeline  # noqa: F401  settles how matrix products are summed, before a stage imports NumPy

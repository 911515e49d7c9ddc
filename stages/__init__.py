"""The six stages: each a short story, read artifacts → call pipeline → write an artifact."""

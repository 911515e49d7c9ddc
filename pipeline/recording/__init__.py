"""Rerun recordings: what each stage shows, and how the viewer lays it out."""

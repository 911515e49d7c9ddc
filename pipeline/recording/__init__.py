"""Rerun: what each stage shows, and its blueprint."""

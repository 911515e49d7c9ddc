"""What the stages of softgrip are made of; imports nothing from ``stages``."""

"""What this machine offers and lacks. Standard library only: it runs before anything is installed."""

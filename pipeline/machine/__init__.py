"""What this machine offers and lacks; standard library only, for it runs before all else."""

"""What `make bench` measures: each module one subject, figures out, no files kept."""

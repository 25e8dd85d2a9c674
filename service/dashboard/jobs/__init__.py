"""Jobs: what waits, what runs and how far it is, what failed and why; and one job in full."""

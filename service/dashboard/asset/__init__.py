"""One asset and its runs, or one job: is this occluder good enough, and where is it not."""

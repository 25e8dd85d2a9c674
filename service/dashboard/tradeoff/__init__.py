"""Time against recall: the runs of an asset, and what a sweep over many settings measured."""

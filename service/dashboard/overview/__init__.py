"""All assets: which are good enough, how they spread, which got worse."""

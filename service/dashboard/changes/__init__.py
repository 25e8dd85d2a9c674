"""What people change of assets: what is demanded of them, their names, whether they are there."""

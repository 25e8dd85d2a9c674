"""Walks and flights through a scene: where its cameras stand and what they look along."""

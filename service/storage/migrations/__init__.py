"""Steps of the schema, each a file in ``versions``; ``alembic revision --rev-id 0002 -m "..."``."""

"""A kind of job: what is visible from view cells."""

from __future__ import annotations

from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

_BEFORE = "'occluder', 'evaluation', 'scene', 'tradeoff'"
_AFTER = f"{_BEFORE}, 'visibility'"


def upgrade() -> None:
    _change(_BEFORE, _AFTER)


def downgrade() -> None:
    gone = "SELECT number FROM jobs WHERE kind = 'visibility'"
    for table in ("job_files", "idempotency_keys", "deliveries"):
        op.execute(f"DELETE FROM {table} WHERE job_number IN ({gone})")
    op.execute("DELETE FROM jobs WHERE kind = 'visibility'")
    _change(_AFTER, _BEFORE)


def _change(old: str, new: str) -> None:
    """Change what a check allows; in SQLite without a copy of the table, by which numbers of
    removed jobs would come again (https://sqlite.org/lang_altertable.html#otheralter)."""
    connection = op.get_bind()
    if connection.dialect.name != "sqlite":
        op.drop_constraint("ck_jobs_kind", "jobs")
        op.create_check_constraint("kind", "jobs", f"kind IN ({new})")
        return
    version = connection.exec_driver_sql("PRAGMA schema_version").scalar_one()
    connection.exec_driver_sql("PRAGMA writable_schema = ON")
    connection.exec_driver_sql(
        "UPDATE sqlite_master SET sql = replace(sql, ?, ?) WHERE type = 'table' AND name = 'jobs'",
        (f"kind IN ({old})", f"kind IN ({new})"),
    )
    connection.exec_driver_sql(f"PRAGMA schema_version = {version + 1}")
    connection.exec_driver_sql("PRAGMA writable_schema = OFF")

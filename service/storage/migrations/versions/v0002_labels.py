"""What the owner of a job calls its inputs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Text

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("job_files", sa.Column("label", Text()))


def downgrade() -> None:
    op.drop_column("job_files", "label")

"""A new column of a job is written down in three files, and goes all the way by itself."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import fields

from service.jobs.job import Job, JobFacts, JobFile, JobTerms, Submission
from service.schemas.job import JobBody
from service.storage.tables import JobFileRow, JobRow
from tests.acceptance.command import ROOT

# After this line comes that one: the field, the column, and what the API says of it.
LINES = {
    "jobs/job.py": (
        "    retry_of: str | None = None\n",
        "    colour: str | None = None\n",
    ),
    "storage/tables.py": (
        "    retry_of: Mapped[str | None] = mapped_column(String(32))\n",
        "    colour: Mapped[str | None]\n",
    ),
    "schemas/job.py": (
        '    retry_of: str | None = Field(description="The job that it does again.")\n',
        '    colour: str | None = Field(description="Of its flag.")\n',
    ),
}
MIGRATION = '''
"""A column more."""

import sqlalchemy as sa
from alembic import op

revision, down_revision = "9999", "{before}"
branch_labels = depends_on = None


def upgrade():
    op.add_column("jobs", sa.Column("colour", sa.String))
'''
ALL_THE_WAY = """
import json, sys
from pathlib import Path
from service.client.values import job_of
from service.jobs.job import JobKind, Submission, Summary
from service.routes.api import make_api
from service.schemas.job import JobBody
from service.storage.sqlite import SqliteDatabase
from service.storage.job_store import SqlJobStore

store = SqlJobStore(SqliteDatabase.open(Path(sys.argv[1])))
job, _ = store.submit(
    Submission(
        tenant="me", kind=JobKind.OCCLUDER, name="a.obj", options={}, inputs=(), version="1",
        colour="red",
    ),
    10,
)
claim = store.claim("worker", 60.0)
store.succeed(claim, (), Summary(1, 1, 1, 0.1))
stored = store.job("me", job.id)
told = JobBody.of(stored, whole_webhook=True).model_dump_json()
properties = make_api().openapi()["components"]["schemas"]["Job"]["properties"]
print(json.dumps({
    "submitted": job.colour,
    "claimed": claim.job.colour,
    "stored": stored.colour,
    "told": json.loads(told)["colour"],
    "heard": job_of(json.loads(told)).colour,
    "described": properties["colour"]["description"],
}))
"""


def test_a_field_a_column_and_a_description_are_all_that_it_takes(tmp_path):
    shutil.copytree(
        ROOT / "service", tmp_path / "service", ignore=shutil.ignore_patterns("__pycache__")
    )
    for name, (after, line) in LINES.items():
        file = tmp_path / "service" / name
        text = file.read_text()
        assert text.count(after) == 1, name
        file.write_text(text.replace(after, after + line))
    versions = tmp_path / "service/storage/migrations/versions"
    before = max(file.name[1:5] for file in versions.glob("v[0-9]*.py"))
    (versions / "v9999_colour.py").write_text(MIGRATION.format(before=before))
    script = tmp_path / "all_the_way.py"
    script.write_text(ALL_THE_WAY)
    done = subprocess.run(
        [sys.executable, script, tmp_path / "occluder.db"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {
        "submitted": "red", "claimed": "red", "stored": "red", "told": "red", "heard": "red",
        "described": "Of its flag.",
    }  # fmt: skip


def test_every_field_of_a_job_is_a_column_unless_it_is_kept_otherwise():
    columns = set(JobRow.__table__.columns.keys())
    assert names(Job) - columns == {"asset", "asset_id"}
    assert names(Submission) - columns == {"asset", "inputs", "may_reuse"}
    assert names(JobFile) - set(JobFileRow.__table__.columns.keys()) == {"blob"}


def test_whatever_is_known_of_a_job_is_told():
    """Its asset's id is told with the asset's name."""
    assert names(JobFacts) - set(JobBody.model_fields) == {"asset_id"}
    assert names(JobTerms) <= set(JobBody.model_fields)


def names(kind: type) -> set[str]:
    return {one.name for one in fields(kind)}

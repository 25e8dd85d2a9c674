"""Assets in the database; see :class:`service.jobs.asset.AssetStore` for what is promised."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import asdict
from unicodedata import normalize

from sqlalchemy import delete, select, tuple_
from sqlalchemy.orm import Session

from service.errors import BadRequestError, ConflictError, NotFoundError
from service.jobs.asset import Asset, AssetPage, RunNumbers, RunPage, Standing, Thresholds
from service.jobs.job import JobState
from service.journal import COMMAND_LINE, Action, Actor
from service.storage.asset_standings import (
    all_runs_at,
    all_standings,
    change_stamp,
    numbers_of,
    standing_of,
)
from service.storage.database import Database, retried
from service.storage.journal_store import note
from service.storage.rows import (
    asset_named,
    asset_of,
    is_run,
    job_of,
    thresholds_of,
    with_runs,
)
from service.storage.tables import AssetRow, JobRow


class SqlAssetStore:
    """Assets and their runs.  A list is one query, whose cost follows the page."""

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock

    def assets(
        self,
        tenant: str | None,
        *,
        name: str | None = None,
        contains: str = "",
        after: str | None = None,
        limit: int = 100,
    ) -> AssetPage:
        """Raises :class:`~service.errors.BadRequestError` for what is no cursor."""
        query = with_runs(tenant).order_by(AssetRow.name, AssetRow.number).limit(limit + 1)
        if name is not None:
            query = query.where(AssetRow.name == name)
        if contains:
            part = normalize("NFC", contains).casefold()
            query = query.where(AssetRow.folded.contains(part, autoescape=True))
        if after is not None:
            query = query.where(tuple_(AssetRow.name, AssetRow.number) > _position(after))
        with self._database.reading() as session:
            found = session.execute(query).all()
            page = tuple(asset_of(*one) for one in found[:limit])
            return AssetPage(page, _cursor(found[limit - 1][0]) if len(found) > limit else None)

    def asset(self, tenant: str | None, asset_id: str) -> Asset:
        with self._database.reading() as session:
            return _read_asset(session, _find(session, tenant, asset_id))

    def runs(
        self, tenant: str | None, asset_id: str, *, before: int | None = None, limit: int = 100
    ) -> RunPage:
        with self._database.reading() as session:
            query = (
                select(JobRow)
                .where(
                    JobRow.asset_number == _find(session, tenant, asset_id).number,
                    is_run(JobRow),
                )
                .order_by(JobRow.number.desc())
                .limit(limit + 1)
            )
            if before is not None:
                query = query.where(JobRow.number < before)
            found = [job_of(row) for row in session.scalars(query)]
        page = tuple(found[:limit])
        return RunPage(page, page[-1].number if len(found) > limit else None)

    @retried
    def put(
        self,
        tenant: str,
        name: str,
        thresholds: Thresholds,
        *,
        by: Actor = COMMAND_LINE,
        before_change: Callable[[], None] = lambda: None,
    ) -> tuple[Asset, bool]:
        with self._database.writing() as session:
            row, made = asset_named(session, tenant, name, self._clock(), lock=True)
            if thresholds_of(row) != thresholds:
                before_change()
                self._demand(session, row, thresholds, by)
            return _read_asset(session, row), made

    @retried
    def set_thresholds(
        self,
        tenant: str | None,
        asset_id: str,
        thresholds: Thresholds,
        *,
        by: Actor = COMMAND_LINE,
    ) -> Asset:
        with self._database.writing() as session:
            row = _find(session, tenant, asset_id, lock=True)
            if thresholds_of(row) != thresholds:
                self._demand(session, row, thresholds, by)
            return _read_asset(session, row)

    def _demand(self, session: Session, row: AssetRow, thresholds: Thresholds, by: Actor) -> None:
        before = asdict(thresholds_of(row))
        for name, value in asdict(thresholds).items():
            setattr(row, name, value)
        session.flush()
        note(
            session, self._clock(), row.tenant, by, Action.THRESHOLDS_SET, row.id,
            {"name": row.name, "before": before, "after": asdict(thresholds)},
        )  # fmt: skip

    @retried
    def remove(self, tenant: str | None, asset_id: str, *, by: Actor = COMMAND_LINE) -> None:
        with self._database.writing() as session:
            row = _find(session, tenant, asset_id, lock=True)
            busy = session.scalars(
                select(JobRow.id)
                .where(
                    JobRow.asset_number == row.number,
                    JobRow.state.in_([JobState.QUEUED, JobState.RUNNING]),
                )
                .limit(1)
            ).first()
            if busy is not None:
                raise ConflictError(
                    f"the job '{busy}' of the asset has not ended",
                    remedy="cancel its jobs or wait for them, then remove it",
                )
            action, told = Action.ASSET_REMOVED, {"name": row.name}
            note(session, self._clock(), row.tenant, by, action, row.id, told)
            session.execute(delete(AssetRow).where(AssetRow.number == row.number))

    def standings(self, tenant: str, *, recalls: int = 20) -> tuple[Standing, ...]:
        with self._database.reading() as session:
            rows = session.execute(all_standings(tenant, recalls))
            return tuple(standing_of(row) for row in rows)

    def runs_at(self, tenant: str, moment: float) -> Mapping[str, RunNumbers]:
        with self._database.reading() as session:
            rows = session.execute(all_runs_at(tenant, moment))
            return {row.id: numbers_of(row) for row in rows}

    def stamp(self, tenant: str) -> Hashable:
        with self._database.reading() as session:
            return tuple(session.execute(change_stamp(tenant)).one())


def _find(session: Session, tenant: str | None, asset_id: str, *, lock: bool = False) -> AssetRow:
    query = select(AssetRow).where(AssetRow.id == asset_id)
    row = session.scalars(query.with_for_update() if lock else query).first()
    if row is None or tenant not in (None, row.tenant):
        raise NotFoundError(
            f"there is no asset '{asset_id}'", remedy="look for it in the list, /v1/assets"
        )
    return row


def _read_asset(session: Session, row: AssetRow) -> Asset:
    """An asset with what its runs say of it."""
    query = with_runs(None).where(AssetRow.number == row.number)
    return asset_of(*session.execute(query).one())


def _cursor(row: AssetRow) -> str:
    """The place after an asset; names alone would do within a tenant only."""
    return f"{row.number}:{row.name}"


def _position(cursor: str) -> tuple[str, int]:
    number, _, name = cursor.partition(":")
    try:
        return name, int(number)
    except ValueError:
        raise BadRequestError(
            f"'{cursor}' is no cursor", remedy="use the address that the page before gave as next"
        ) from None

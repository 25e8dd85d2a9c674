"""The service with its pages, as its surroundings say."""

from __future__ import annotations

from fastapi import FastAPI

from service.app import create_app
from service.settings import Settings


def make_app() -> FastAPI:
    return create_app(Settings())

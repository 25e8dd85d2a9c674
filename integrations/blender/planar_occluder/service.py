"""An occluder by a service, as ``docs/service.md`` describes it.

A thread asks, so that the window goes on; it touches nothing of Blender.
"""

import json
import threading
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode, urlsplit
from urllib.request import HTTPRedirectHandler, Request, build_opener

from .run import Made, RunError

_SILENCE = 30.0  # seconds without a word of the server
_GLANCE = 0.5  # seconds between two questions


class _NoRedirect(HTTPRedirectHandler):
    def redirect_request(self, *_):
        """None: the key must not go to another host."""


_OPENER = build_opener(_NoRedirect)


class ServiceRun:
    """Raises RunError where the address is none."""

    def __init__(self, server, key, mesh, options):
        if urlsplit(server).scheme not in ("http", "https"):
            raise RunError(
                f"'{server}' is not an address of a service: it begins with http:// or https://"
            )
        self.share = 0.0
        self._server, self._key = server.rstrip("/"), key
        self._made = self._error = None
        self._unwanted = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(mesh, options), daemon=True)
        self._thread.start()

    def poll(self):
        if self._thread.is_alive():
            return None
        if self._error is not None:
            raise self._error
        return self._made

    def cancel(self):
        """The job is ended by the thread, which may outlive this by one question."""
        self._unwanted.set()

    def _run(self, mesh, options):
        try:
            self._made = self._ask_for(mesh, options)
        except RunError as error:
            self._error = error
        except Exception as error:  # an answer that is none of the service's
            self._error = RunError(f"{self._server} gave no usable answer ({error!r})")

    def _ask_for(self, mesh, options):
        query = urlencode({name: _word(value) for name, value in options.items()} | {"lods": 1})
        answer = json.loads(self._send(f"/v1/occluders?filename=mesh.ply&{query}", mesh))
        job = answer.get("job", answer)  # a result, where the same work was done before
        path = f"/v1/jobs/{job['id']}"
        while job["state"] in ("queued", "running"):
            if self._unwanted.wait(_GLANCE):
                self._send(f"{path}/cancel", b"")
                raise RunError("cancelled")
            job = json.loads(self._send(path))
            self.share = (job.get("progress") or {}).get("fraction", self.share)
        if job["state"] != "succeeded":
            raise RunError(
                (job.get("failure") or {}).get("detail") or f"the job was {job['state']}"
            )
        report = json.loads(self._send(f"{path}/files/report.json"))
        return Made(self._send(f"{path}/files/lod0.ply"), report)

    def _send(self, path, body=None):
        request = Request(self._server + path, body, {"Accept": "*/*"})
        if body is not None:
            request.add_header("Content-Type", "application/octet-stream")
        if self._key:
            request.add_unredirected_header("Authorization", f"Bearer {self._key}")
        try:
            with _OPENER.open(request, timeout=_SILENCE) as response:
                return response.read()
        except HTTPError as error:
            raise RunError(f"{self._server}: {_detail(error)}") from None
        except (URLError, OSError) as error:
            raise RunError(
                f"{self._server} does not answer ({getattr(error, 'reason', error)}): check the "
                "address in the add-on's preferences"
            ) from None


def _word(value):
    return str(value).lower() if isinstance(value, bool) else value


def _detail(error):
    """What a problem says (RFC 9457), or the status."""
    try:
        problem = json.loads(error.read())
        return " ".join(filter(None, [problem["detail"], problem.get("remedy")]))
    except (ValueError, KeyError, TypeError, OSError):
        return f"{error.code} {error.reason}"

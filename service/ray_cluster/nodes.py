"""Which nodes of a Ray cluster may get work: those that run this release, and are set up for it.

Each node is asked once, by a small task that only that node may run, since only what a node's own
processes import tells which release it has.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from typing import Any

from service.ray_cluster.joining import has_token, is_loopback
from simplifier import __version__

_NODE_ID = "ray.io/node-id"  # Ray's own label of each node
_LONGEST = 300  # characters of why a node gets none

_log = logging.getLogger(__name__)

Probe = Callable[[str], None]
"""Called on a node with the release that works; raises :class:`UnfitNodeError` where the node is to
get none.  A function of a module, as it goes by name."""


class UnfitNodeError(Exception):
    """A node gets no work; the message says why."""


def check_node(release: str) -> None:
    """The least that is asked of a node; raises :class:`UnfitNodeError`."""
    import ray

    if __version__ != release:
        raise UnfitNodeError(f"it runs release {__version__}, and {release} works")
    address = ray.util.get_node_ip_address()
    if not is_loopback(address) and not has_token(os.environ):
        raise UnfitNodeError("its Ray asks nobody for a token; start it with RAY_AUTH_MODE=token")


class Nodes:
    """What is known of the nodes.  For one thread."""

    def __init__(self, ray: Any, probe: Probe = check_node) -> None:
        self._ray = ray
        self._probe = ray.remote(probe)
        self._asked: dict[str, Any] = {}
        self._fit: set[str] = set()
        self._unfit: dict[str, str] = {}
        self._alive: dict[str, Mapping[str, float]] = {}

    @property
    def unfit(self) -> Mapping[str, str]:
        """Why a node gets no work, by its id."""
        return self._unfit

    @property
    def count(self) -> int:
        """Nodes with processors that may get work."""
        return sum(self._alive[node].get("CPU", 0.0) > 0.0 for node in self._fit)

    @property
    def processors(self) -> int:
        """Those of all nodes that may get work."""
        counts = (self._alive[node].get("CPU", 0.0) for node in self._fit)
        return int(sum(counts))

    @property
    def largest_memory(self) -> int:
        """Bytes that tasks may ask for on the largest of them; 0 where there is none."""
        return int(max((self._alive[node].get("memory", 0.0) for node in self._fit), default=0.0))

    def look(self, seconds: float = 0.0) -> None:
        """Ask nodes that have come, and hear those that were asked, waiting for so long at most."""
        self._alive = {
            node["NodeID"]: node["Resources"] for node in self._ray.nodes() if node["Alive"]
        }
        known = self._alive.keys()
        self._fit &= known
        self._unfit = {node: why for node, why in self._unfit.items() if node in known}
        self._asked = {node: answer for node, answer in self._asked.items() if node in known}
        for node in known - self._fit - self._unfit.keys() - self._asked.keys():
            self._asked[node] = self._ask(node)
        self._hear(seconds)

    def placement(self) -> dict[str, Any]:
        """Options of a task that keep it from nodes that are to get none."""
        if not self._unfit:
            return {}
        return {"label_selector": {_NODE_ID: f"!in({','.join(sorted(self._unfit))})"}}

    def _ask(self, node: str) -> Any:
        strategies = self._ray.util.scheduling_strategies
        only_there = strategies.NodeAffinitySchedulingStrategy(node, soft=False)
        asking = self._probe.options(num_cpus=0, max_retries=0, scheduling_strategy=only_there)
        return asking.remote(__version__)

    def _hear(self, seconds: float) -> None:
        if not self._asked:
            return
        waiting = list(self._asked.values())
        answered, _ = self._ray.wait(waiting, num_returns=len(waiting), timeout=seconds)
        for node, answer in list(self._asked.items()):
            if answer not in answered:
                continue
            del self._asked[node]
            try:
                self._ray.get(answer)
            except (self._ray.exceptions.WorkerCrashedError, self._ray.exceptions.NodeDiedError):
                continue  # it is asked again, if it is there
            except Exception as error:
                self._unfit[node] = _why(error)
                _log.error("the Ray node %s gets no work: %s", node[:12], self._unfit[node])
            else:
                self._fit.add(node)


def _why(error: Exception) -> str:
    cause = getattr(error, "cause", None) or error
    if isinstance(cause, UnfitNodeError):
        return str(cause)
    # Of a task that cannot even be imported there; the last line is the error itself.
    last = str(cause).strip().splitlines() or [type(cause).__name__]
    return f"it cannot run this release ({last[-1].strip()[:_LONGEST]})"

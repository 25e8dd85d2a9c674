"""The commands that the service adds to ``occluder``, as its help lists them.

They are found by the entry points of the group ``occluder.commands``.
"""

from __future__ import annotations

from simplifier.cli.lazy import LazyCommand

serve = LazyCommand(
    "service.cli.serve:serve",
    "Serve occluders by HTTP: post a mesh and get triangles back.",
)
work = LazyCommand(
    "service.cli.work:work",
    "Do the jobs of servers that share a database, on any machine, and answer nobody.",
)
dispatch = LazyCommand(
    "service.cli.dispatch:dispatch",
    "Offer the jobs of servers that share a database to the nodes of a Ray cluster.",
)
submit = LazyCommand(
    "service.cli.submit:submit",
    "Have occluders made by a service: send meshes, wait, fetch NAME_occluder beside each.",
)
keys = LazyCommand(
    "service.cli.keys:keys",
    "Make, list, rotate and revoke the API keys of a service, beside it or while it runs.",
)
webhooks = LazyCommand(
    "service.cli.webhooks:webhooks",
    "List and send again the webhooks of a service, and rotate their secrets.",
)
verify = LazyCommand(
    "service.cli.verify:verify",
    "Read all files that a service stores, and say which are damaged or gone.",
)
migrate = LazyCommand(
    "service.cli.migrate:migrate",
    "Bring the database to this release, whose workers get the work from then on.",
)

"""The HTTP service: POST a mesh and get occluders back.

It uses of the library only what :mod:`simplifier` exports.  Layers, high to low, as the import
contracts in ``pyproject.toml`` say:

    cli          the commands ``occluder serve``, ``keys`` and ``submit``
    openapi      writes openapi.yaml
    app, client  everything put together; the other end of the wire
    routes       one file a resource of the API
    schemas      what goes over the wire
    storage      the database and the blobs
    engines      the processes that do jobs
    access       who may do what
    webhooks     telling others that a job has ended
    jobs         what a job is, and what storage and engines promise each other
    settings, errors
"""

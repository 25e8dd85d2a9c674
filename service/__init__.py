"""The HTTP service: POST a mesh and get occluders back.

It uses of the library only what :mod:`simplifier` exports.  Layers, high to low, as the import
contracts in ``pyproject.toml`` say:

    cli          the commands ``occluder serve``, ``keys``, ``submit`` and ``webhooks``
    openapi      writes openapi.yaml
    app, client  everything put together; the other end of the wire
    middleware   what surrounds every request
    routes       one file a resource of the API
    uploads      what requests bring, read as it comes
    answers      what is sent back: results, files, refusals
    schemas      what goes over the wire
    metrics      what is counted for Prometheus
    storage      the database and the blobs
    engines      the processes that do jobs
    webhooks     telling others that a job has ended
    access       who may do what
    headers      what headers say, each as its standard has it
    jobs         what a job is, and what storage and engines promise each other
    settings     what the service is told by its surroundings
    errors, logs every refusal; how lines of the log are written
"""

"""The pages for people: what came out, whether it is good enough, what got worse.

    mount       NiceGUI within the service's application
    gate        who may see pages, and what browsers may do with them
    visitor     on whose behalf a page and each of its handlers act
    sign_in     the form that takes a key and gives a cookie
    frame       what surrounds every page
    overview/   all assets
    asset/      one asset, its runs, and two of them beside each other
    submit/     a mesh and its settings, sent by the browser
    jobs/       what waits, runs and has ended; one job
    tradeoff/   time against recall, of runs and of sweeps
    viewer      the 3D view, drawn by drawing/
    view_map    views on a sphere, unrolled

Each room has a file a page, its panels below it, and a file that makes plain values of what is
stored, without a browser: ``asset_lines``, ``details``, ``comparison``, ``job_lines``, ``points``.

Pages never keep the event loop waiting for the database: they call the stores in threads.
"""

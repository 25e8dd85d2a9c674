"""The pages for people: what came out, whether it is good enough, what got worse.

    mount       NiceGUI within the service's application
    gate        who may see pages, and what browsers may do with them
    session     on whose behalf a page and each of its handlers act
    sign_in     the form that takes a key and gives a cookie
    frame       what surrounds every page
    overview/   all assets
    asset/      one asset and its runs
    compare/    two runs beside each other
    viewer/     the 3D view
    view_map/   views on a sphere, unrolled
    submit/     a mesh and its settings, sent by the browser
    jobs/       what waits, runs and has ended; one job
    tradeoff/   time against recall, of runs and of sweeps

A room has a file a panel; its ``page.py`` only puts them together, and its ``rows.py`` makes plain
values of what is stored, without a browser.  Pages never keep the event loop waiting for the
database: they call the stores in threads.
"""

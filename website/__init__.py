"""The documentation as a site: what is done to the pages of ``docs/``, and the pages made for it.

``mkdocs.yml`` names :mod:`website.hooks`, which calls the rest.  Needs the extra ``docs``.
"""

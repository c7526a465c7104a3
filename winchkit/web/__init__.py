"""The page: ``winchkit serve``. A client of the public API and of the bench's station.

It holds no physics and no supervision: :mod:`~winchkit.web.work` holds the runs and the profile of
the page, :mod:`~winchkit.web.workspace` its requests, :mod:`~winchkit.web.model_errors` and
:mod:`~winchkit.web.curves` the data of its drawings, :mod:`~winchkit.web.application` the routes,
:mod:`~winchkit.web.guard` what is refused, :func:`~winchkit.web.server.serve` the entry. The Bench
view is the folder ``bench``; those of the wings are :mod:`~winchkit.web.views`; the browser's part
is in ``static``.
"""

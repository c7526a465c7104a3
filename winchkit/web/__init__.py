"""The page: ``winchkit serve``. A client of the public API and of the bench's station.

It holds no physics and no supervision: :mod:`~winchkit.web.workspace` holds the runs and the
profile of the page, :mod:`~winchkit.web.ladder` and :mod:`~winchkit.web.curves` the data of its
drawings, :mod:`~winchkit.web.application` the routes and what they refuse,
:func:`~winchkit.web.server.serve` the entry. The Library view is the
folder ``library``; the browser's part is in ``static``.
"""
